"""What the map of a run shows beside the robot, fetched in a thread: places, true objects, proposed ones."""

import json
import threading
from collections.abc import Callable
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.watching.place import MapBox, Place, boxes_of, place_of, truth_of

Surroundings = Callable[[str], tuple[Place | None, tuple[MapBox, ...]]]
"""Returns the place of an environment and its true objects. Raises BenchbotError."""


class Scenery:
    """Fetches each thing once, and has nothing of it until then. What cannot be had is not asked for again."""

    def __init__(self, surroundings: Surroundings | None = None) -> None:
        self._surroundings = surroundings or _installed()
        self._places: dict[str, tuple[Place | None, tuple[MapBox, ...]]] = {}
        self._boxes: dict[Path, tuple[MapBox, ...]] = {}
        self._asked: set[object] = set()
        self._came: list[object] = []

    @property
    def fetched(self) -> int:
        """How many things have come: when there are more, there is more to show."""
        return len(self._came)

    def place(self, environment: str) -> tuple[Place | None, tuple[MapBox, ...]]:
        """Return what is known of an environment by now."""
        self._fetch(environment, lambda: self._places.update({environment: self._surroundings(environment)}))
        return self._places.get(environment, (None, ()))

    def boxes(self, result: Path | None) -> tuple[MapBox, ...]:
        """Return what a result proposes, as far as it is known by now."""
        if result is None:
            return ()
        self._fetch(result, lambda: self._boxes.update({result: _read(result)}))
        return self._boxes.get(result, ())

    def _fetch(self, what: object, fetch: Callable[[], None]) -> None:
        if what in self._asked:
            return
        self._asked.add(what)
        threading.Thread(target=self._carry_out, args=(what, fetch), daemon=True, name="benchbot-scenery").start()

    def _carry_out(self, what: object, fetch: Callable[[], None]) -> None:
        try:
            fetch()
        except BenchbotError:
            return  # the map shows what else there is
        self._came.append(what)


def _installed() -> Surroundings:
    def found(environment: str) -> tuple[Place | None, tuple[MapBox, ...]]:
        from benchbot.core import plugin_manager
        from benchbot.core.declarations.catalog import Catalog

        catalog = Catalog(plugin_manager.load())
        return place_of(catalog, environment), truth_of(catalog, environment)

    return found


def _read(result: Path) -> tuple[MapBox, ...]:
    try:
        document = json.loads(result.read_bytes())
    except (OSError, ValueError):
        return ()
    return boxes_of(document) if isinstance(document, dict) else ()
