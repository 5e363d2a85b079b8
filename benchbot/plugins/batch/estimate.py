"""How long episodes may take, judged by those of earlier batches of this user on this machine."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from statistics import fmean

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.driver_lock import registered_batches
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.status_lines import duration

MOST_BATCHES = 8
MOST_EPISODES = 6
"""How many episodes of each robot and environment are looked at in each batch."""

Place = tuple[str, str]
"""A robot and an environment."""


@dataclass(frozen=True)
class Durations:
    """The mean duration of an episode in each place, as far as it is known, and how many episodes say so."""

    of_place_s: Mapping[Place, float]
    episodes: int

    def total_s(self, counts: Mapping[Place, int], workers: int) -> float | None:
        """Return how long so many episodes take; a place that is not known counts as the mean of those that are.

        None when nothing is known.
        """
        if not self.of_place_s:
            return None
        usual_s = fmean(self.of_place_s.values())
        return sum(count * self.of_place_s.get(place, usual_s) for place, count in counts.items()) / max(1, workers)

    def told(self, counts: Mapping[Place, int], workers: int) -> str:
        """Return that in words, with what it rests on."""
        total_s = self.total_s(counts, workers)
        if total_s is None:
            return "How long it takes is not known: no earlier batch of this task on this machine."
        unknown = sum(place not in self.of_place_s for place in counts)
        guessed = f"; {unknown} of {len(counts)} places were never computed, and count as the others" if unknown else ""
        on = f"{workers} worker{'s' * (workers != 1)}"
        return f"About {duration(total_s)} on {on}, as {self.episodes} episodes of earlier batches took{guessed}."


def durations(task: str, places: Iterable[Place]) -> Durations:
    """Return the durations of finished episodes of a task, of the newest batches that are registered here."""
    wanted = set(places)
    found: dict[Place, list[float]] = {}
    for entry in registered_batches()[:MOST_BATCHES]:
        folder = Folder(entry.folder)
        with suppress(BenchbotError, OSError):
            plan = plans.read(folder.plan)
            looked: dict[Place, int] = {}
            for episode in plan.episodes if plan.task == task else ():
                place = (episode.robot, episode.environment)
                if place not in wanted or looked.get(place, 0) >= MOST_EPISODES:
                    continue
                ended = [each for each in folder.attempts(episode).entries() if "duration_s" in each]
                if ended:
                    looked[place] = looked.get(place, 0) + 1
                    found.setdefault(place, []).append(float(ended[-1]["duration_s"]))
    return Durations({place: fmean(each) for place, each in found.items()}, sum(map(len, found.values())))
