"""The episodes that are left for a worker, and the order of its choice; all its choices take linear time in total."""

import random
from collections import Counter, OrderedDict
from collections.abc import Iterable, Iterator
from typing import TypeVar

from benchbot.plugins.batch.plan import PlannedEpisode, SceneKey

T = TypeVar("T")


class Pending:
    """Episodes by their key, in their scenes. Workers of different names that begin together spread over the scenes."""

    def __init__(self, episodes: Iterable[PlannedEpisode], worker: str) -> None:
        self._episodes = {episode.key: episode for episode in episodes}
        # Unlike a dict's, the first entry is found at once after others before it were deleted.
        found: dict[SceneKey, OrderedDict[str, None]] = {}
        for key, episode in self._episodes.items():
            found.setdefault(episode.scene, OrderedDict())[key] = None
        chance = random.Random(worker)  # noqa: S311
        order = {scene: (-len(keys), chance.random()) for scene, keys in found.items()}
        self._scenes = OrderedDict((scene, found[scene]) for scene in sorted(found, key=order.__getitem__))

    def __len__(self) -> int:
        return len(self._episodes)

    def of(self, keys: Iterable[str]) -> list[PlannedEpisode]:
        """Return those with these keys, without those that are not left."""
        return [self._episodes[key] for key in keys if key in self._episodes]

    def drop(self, episode: PlannedEpisode) -> None:
        """Forget an episode, if it is still there."""
        if self._episodes.pop(episode.key, None) is not None:
            scene = self._scenes[episode.scene]
            del scene[episode.key]
            if not scene:
                del self._scenes[episode.scene]

    def candidates(self, claimed: set[str], loaded: SceneKey | None) -> Iterator[PlannedEpisode]:
        """Yield the episodes without a claim; any may be dropped meanwhile.

        First those of the scene that is loaded, then of scenes without a worker, the largest first, then of those with
        the fewest workers.
        """
        for scene in self._order(Counter(episode.scene for episode in self.of(claimed)), loaded):
            passed = set(claimed)
            while (key := _first(self._scenes.get(scene, ()), passed)) is not None:
                passed.add(key)
                yield self._episodes[key]

    def _order(self, workers: Counter[SceneKey], loaded: SceneKey | None) -> Iterator[SceneKey]:
        passed = set(workers)
        if loaded is not None:
            passed.add(loaded)
            yield loaded
        while (scene := _first(self._scenes, passed)) is not None:
            passed.add(scene)
            yield scene
        yield from sorted(workers.keys() - {loaded}, key=workers.__getitem__)


def _first(values: Iterable[T], passed: set[T]) -> T | None:
    return next((value for value in values if value not in passed), None)
