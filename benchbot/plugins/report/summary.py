"""The facts of a report: what was measured, how well it went and what went wrong, in words, tallies and bars."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Any

from benchbot.core.errors import FailureClass
from benchbot.evaluation import coverage
from benchbot.plugins.drawing.map_model import FALSE_NEGATIVE, FALSE_POSITIVE, IGNORED, MATCH, MapObject
from benchbot.plugins.report.bars import Axis, Bar, bar_of
from benchbot.plugins.report.episodes import UNKNOWN, ReportData, ReportedEpisode, grouped

NO_CLASS = "none given"
TIME_KEYS = ("simulated_time_s", "robot_time_s")
"""The keys of the time by the robot's clock: of a simulated robot, of a real one."""
MEANINGS = {
    FailureClass.AGENT: "The solution crashed, or handed in nothing that could be used.",
    FailureClass.COLLISION: "The robot hit something.",
    FailureClass.TIMEOUT: "The solution took longer than it was given.",
    FailureClass.PLATFORM: "The simulator or the robot died, or was stopped for safety: no fault of the solution.",
    FailureClass.INFRASTRUCTURE: "The machine or the software that measures failed: no fault of the solution.",
    NO_CLASS: "The result is missing or cannot be scored.",
}
VERDICTS = {
    MATCH: "found",
    FALSE_POSITIVE: "not there",
    FALSE_NEGATIVE: "missed",
    IGNORED: "not counted",
}
"""The outcome of an object, in a word that needs no statistics."""


@dataclass(frozen=True)
class Interval:
    """A confidence interval of a score and its level, such as 0.95."""

    low: float
    high: float
    level: float

    @property
    def name(self) -> str:
        """The level in words: `95 % interval`."""
        return f"{self.level * 100:g} % interval"


@dataclass
class ClassTally:
    """The outcomes of the objects of one class."""

    name: str
    there: int = 0
    found: int = 0
    missed: int = 0
    not_there: int = 0
    qualities: list[float] = field(default_factory=list)

    @property
    def quality(self) -> float | None:
        """The mean quality of those that were found."""
        return sum(self.qualities) / len(self.qualities) if self.qualities else None


@dataclass(frozen=True)
class Drive:
    """The cost of an episode over all its attempts, as far as its result says: steps, seconds, metres, collisions."""

    episode: ReportedEpisode
    steps: int | None
    robot_time_s: float | None
    path_length_m: float | None
    collisions: int | None
    restarts: int = 0


def title(data: ReportData) -> str:
    """Return what the report is about: the name that was given, else that of the solution's file."""
    if data.name is not None:
        return data.name
    names = set()
    for episode in data.episodes:
        solution = episode.provenance.get("solution") or {}
        files = list(solution.get("files") or {}) or [word for word in solution.get("command", ())[1:] if "." in word]
        names |= {PurePosixPath(str(file)).stem for file in files[:1]}
    return names.pop() if len(names) == 1 else "A solution"


def environments_in_words(data: ReportData) -> str:
    """Return how many environments there are and, when they are few, which."""
    names = [name for name in data.environments if name != UNKNOWN]
    number = f"{len(names)} environment{'' if len(names) == 1 else 's'}"
    return f"{number} ({', '.join(names)})" if 0 < len(names) <= 5 else number


def robots(data: ReportData) -> list[tuple[str, str]]:
    """Return the robots and what their declarations say of them, which may be nothing."""
    names = sorted({episode.robot for episode in data.episodes if episode.robot is not None})
    declared = [data.catalog.find("robots", name) for name in names]
    said = ["" if robot is None else str(robot.data.get("description", "")) for robot in declared]
    return list(zip(names, said, strict=True))


def interval(data: ReportData, name: str) -> Interval | None:
    """Return the interval of a combined score, None when it is not known."""
    found = (data.scores.get("intervals") or {}).get(name)
    return None if found is None else Interval(found["low"], found["high"], found["level"])


def reading(data: ReportData, name: str) -> str:
    """Return how a score is read, in a sentence; nothing when that is not known."""
    score = data.evaluator.score(name)
    if score.lower_is_better is None:
        return ""
    best = score.least if score.lower_is_better else score.greatest
    said = "Less is better" if score.lower_is_better else "More is better"
    return f"{said}." if best is None else f"{said}; {best:g} is the best there can be."


def arrow(data: ReportData, name: str) -> str:
    """Return the arrow that papers put beside a score: up when more is better, down when less is."""
    return {None: "", False: "↑", True: "↓"}[data.evaluator.score(name).lower_is_better]


def arrows_in_words(data: ReportData) -> str:
    """Return what the arrows mean that there are beside scores."""
    meanings = {"↑": "↑ more is better", "↓": "↓ less is better"}
    used = {arrow(data, name) for name in data.score_names}
    said = ", ".join(meaning for sign, meaning in meanings.items() if sign in used)
    return f"; {said}" if said else ""


def missing_in_words(data: ReportData) -> str:
    """Return how what is missing counts, in the scores that there are."""
    if not data.missing_count_as_zero:
        return "left out of the scores"
    # A method gives what is missing no error: zero would be perfect.
    without = [name for name in data.score_names if name not in data.evaluator.combine([{}])]
    return f"counted as zero in every score{' but ' if without else ''}{', '.join(without)}"


def means_in_words(data: ReportData) -> str:
    """Return what scores are a mean of, where not of all results, in sentences; nothing where they are of all."""
    return "".join(f" {text}." for text in coverage.means_in_words(data.scores["coverage"], data.score_names))


def variables(data: ReportData, axis: Axis) -> list[tuple[str, list[Bar]]]:
    """Return what differs between the episodes, of place, variant, robot and seed, and a bar for each of its values."""
    keys: dict[str, Callable[[ReportedEpisode], str]] = {
        "place": lambda episode: episode.place,
        "variant": lambda episode: episode.variant or UNKNOWN,
        "robot": lambda episode: episode.robot or UNKNOWN,
        "seed": lambda episode: UNKNOWN if episode.seed is None else str(episode.seed),
    }
    found = []
    for name, key in keys.items():
        groups = grouped([episode for episode in data.episodes if episode.environment != UNKNOWN], key)
        says_more = name != "place" or len(groups) < len(data.environments)
        if says_more and len([level for level in groups if level != UNKNOWN]) > 1:
            bars = [bar_of(level, episodes, data, axis) for level, episodes in groups.items()]
            found.append((name, bars))
    return found


def failures(data: ReportData) -> dict[str, list[ReportedEpisode]]:
    """Return the failed and missing episodes by class, a key of MEANINGS, those of the solution first."""
    failed = [episode for episode in data.episodes if episode.failure is not None or episode.scores is None]
    found = {str(name): [each for each in failed if (each.failure or NO_CLASS) == name] for name in MEANINGS}
    return {name: episodes for name, episodes in found.items() if episodes}


def shown_first(episodes: Sequence[ReportedEpisode], name: str) -> list[ReportedEpisode]:
    """Return the episodes of an environment that can be looked at, the one whose score is in the middle first.

    Those that were not scored come last, and only if it is known where the robot went.
    """
    scored = [episode for episode in episodes if episode.scores is not None]
    failed = [episode for episode in episodes if episode.scores is None and (episode.document or {}).get("track")]
    ranked = sorted(scored, key=lambda episode: (episode.scores or {}).get(name, 0.0))
    middle = ranked[(len(ranked) - 1) // 2 :][:1]
    return [*middle, *(episode for episode in scored if episode not in middle), *failed]


def by_class(objects: Iterable[MapObject]) -> list[ClassTally]:
    """Return the tally of each class, those with most failures first, then those of the worst quality."""
    tallies: dict[str, ClassTally] = {}
    for item in objects:
        if item.verdict in VERDICTS and item.verdict != IGNORED:
            tally = tallies.setdefault(item.name, ClassTally(item.name))
            tally.there += item.verdict != FALSE_POSITIVE
            tally.found += item.verdict == MATCH
            tally.missed += item.verdict == FALSE_NEGATIVE
            tally.not_there += item.verdict == FALSE_POSITIVE
            if item.verdict == MATCH and item.quality is not None:
                tally.qualities.append(item.quality)
    return sorted(
        tallies.values(), key=lambda tally: (-tally.missed - tally.not_there, tally.quality or 0.0, tally.name)
    )


def drives(data: ReportData) -> list[Drive]:
    """Return what each episode took, of those whose results say so."""
    found = []
    for episode in data.episodes:
        spent = episode.provenance.get("spent")
        if spent is not None:
            names = ("steps", "path_length_m", "collisions", "restarts")
            found.append(Drive(episode, robot_time_s=_time_s(spent), **{name: spent[name] for name in names}))
            continue
        steps, time_s = episode.provenance.get("steps"), _time_s(episode.provenance)
        recorded = [path for path in episode.paths if path.recorded]
        lengths = [path.path_length_m for path in recorded if path.path_length_m is not None]
        collisions = [path.collisions for path in recorded if path.collisions is not None]
        if steps is not None or recorded:
            total_m = sum(lengths) if lengths else None
            found.append(Drive(episode, steps, time_s, total_m, sum(collisions) if collisions else None))
    return found


def _time_s(told: Mapping[str, Any]) -> float | None:
    """Return the time by the robot's clock in provenance, or in what was spent: simulated, or a real robot's."""
    return next((told[key] for key in TIME_KEYS if key in told), None)


def robot_facts(episode: ReportedEpisode) -> list[tuple[str, str]]:
    """Return what the result of a real robot rests on: what its diagnosis found, and its driver's plain facts."""
    robot = episode.provenance.get("robot") or {}
    found = [
        f"{one['level']}: {one['name']}: {one['text']}" for one in robot.get("findings", ()) if one["level"] != "ok"
    ]
    driver = {key: value for key, value in robot.get("driver", {}).items() if isinstance(value, str | int)}
    return [
        ("overridden (--despite)", ", ".join(robot.get("despite", ()))),
        ("diagnosis of the robot", "; ".join(found)),
        ("driver of the robot", ", ".join(f"{key} {value}" for key, value in driver.items())),
    ]


def distributions(data: ReportData) -> list[tuple[str, str, str]]:
    """Return name, version and SHA-256 of every distribution that the results were made with, in every version."""
    return sorted(
        {
            (str(name), str(plugin.get("version", "")), str(plugin.get("sha256", "")))
            for episode in data.episodes
            for name, plugin in (episode.provenance.get("plugins") or {}).items()
        }
    )


def mixed(found: Sequence[tuple[str, str, str]]) -> list[str]:
    """Return the distributions that are there in more than one version, so that results are hard to compare."""
    names = [name for name, *_ in found]
    return sorted({name for name in names if names.count(name) > 1})
