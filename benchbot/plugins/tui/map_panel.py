"""The map of a run in its frame, with the legend of its colours; what it shows is fetched in threads."""

import json
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.screen import Screen
from textual.widgets import Footer, Static

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing.map_model import MapObject, MapPath, Points, SceneMap, Vector, estimated_objects
from benchbot.plugins.drawing.scene_maps import installed_map
from benchbot.plugins.tui import panels
from benchbot.plugins.tui.map_canvas import CHARACTERS, RunMap, cleaned
from benchbot.plugins.tui.raster import Raster, RasterPanel, make
from benchbot.plugins.watching.views import RunView

SCANNERS = ("laser", "lidar", "base_link")
"""The frames that a laser may be read in, and the one that it is near at least."""
ZOOMS = (1.0, 1.5, 2.0, 3.0, 5.0, 8.0)

Surroundings = Callable[[str], SceneMap]
"""Returns the map of an environment with its true objects. Raises BenchbotError."""


class MapPanel(RasterPanel):
    """Shows a map; one that it shows already costs nothing."""

    def __init__(self, box: Raster, *, id: str | None = None) -> None:  # noqa: A002 - as Textual names it
        super().__init__(box, id=id)
        self._key: object = None
        self._map: RunMap | None = None

    def show(self, run_map: RunMap, key: object) -> None:
        """Show a map; `key` is equal for maps that look the same."""
        if key == self._key:
            return
        self._key, self._map = key, run_map
        scene = run_map.scene
        known = bool(scene.name or scene.robot_xyyaw or scene.path.points)
        self._box.show(run_map if known else None, "Nothing is known of this place yet.")
        self.tell_legend()

    def tell_legend(self) -> None:
        """Fit the legend, and say how much the map shows."""
        run_map, size = self._map, self._box.size
        if run_map is None or size.width < 2 or size.height < 1:
            return
        transform = run_map.transform(size.width, 2 * size.height)
        zoom = f" · {run_map.zoom:g}×" if run_map.zoom != 1 else ""
        truth = " · with the truth" if run_map.scene.truth else ""
        self.border_title = f"Map{zoom}{truth}"
        self.border_subtitle = f"{transform.width_m:.1f} × {transform.height_m:.1f} m"
        if self.app.no_color:
            self._legend.tell(CHARACTERS)
        else:
            entries = run_map.legend(dark=self.app.current_theme.dark)
            self._legend.tell(panels.legend(entries, self.size.width - 2))


class Scenery:
    """The maps of environments and the estimated objects of results, each fetched once, in a thread.

    Until one has arrived, an empty one is returned. One that cannot be read is not tried again.
    """

    def __init__(self, surroundings: Surroundings | None = None) -> None:
        self._surroundings = surroundings or _installed
        self._asked: set[str | Path] = set()
        self._found: dict[str | Path, Any] = {}

    @property
    def fetched(self) -> int:
        """The number of maps and results that have arrived: when it grows, there is more to show."""
        return len(self._found)

    def surroundings(self, environment: str) -> SceneMap:
        """Return what is known of an environment by now."""
        return self._get(environment, self._surroundings) or SceneMap()

    def estimates(self, result: Path | None) -> tuple[MapObject, ...]:
        """Return the estimated objects of a result, as far as it is known by now."""
        return () if result is None else self._get(result, _read) or ()

    def _get(self, key: Any, fetch: Callable[[Any], Any]) -> Any:
        if key not in self._asked:
            self._asked.add(key)
            threading.Thread(target=self._fetch, args=(key, fetch), daemon=True, name="benchbot-scenery").start()
        return self._found.get(key)

    def _fetch(self, key: Any, fetch: Callable[[Any], Any]) -> None:
        with suppress(BenchbotError):  # the map shows what else there is
            self._found[key] = fetch(key)


def _installed(environment: str) -> SceneMap:
    return installed_map(Catalog(plugin_manager.load()), environment)


def _read(result: Path) -> tuple[MapObject, ...]:
    try:
        document = json.loads(result.read_bytes())
    except (OSError, ValueError):
        return ()
    return tuple(estimated_objects(document.get("results"))) if isinstance(document, dict) else ()


def map_of_run(view: RunView, scenery: Scenery, zoom: int, *, truth: bool) -> tuple[RunMap, object]:
    """Return the map of a view, and a key that is equal for maps that look the same; `zoom` is a place in ZOOMS."""
    around = scenery.surroundings(environment_of_run(view))
    pose = view.progress.get("pose_xyyaw")
    robot = None if pose is None else (float(pose[0]), float(pose[1]), float(pose[2]))
    laser = None
    if view.snapshot is not None and view.snapshot.laser is not None and robot is not None:
        scans = view.snapshot.laser
        laser = endpoints(scans["scans"], float(scans.get("range_max", float("inf"))), _scanner(view) or robot)
    estimates = scenery.estimates(view.result)
    scene = replace(
        around,
        robot_xyyaw=robot,
        path=MapPath(view.path, recorded=True),
        laser=laser,
        objects=(*estimates, *(around.objects if truth else ())),
    )
    number = None if view.snapshot is None else view.snapshot.number
    return RunMap(cleaned(scene), ZOOMS[zoom]), (around.name, robot, view.path, number, scene.objects, zoom)


def environment_of_run(view: RunView) -> str:
    """Return the environment of the scene that the run is in."""
    scenes = view.session.get("environments") or ()
    number = int(view.progress.get("scene_number", 0))
    if number < len(scenes):
        return f"{scenes[number].get('name')}:{scenes[number].get('variant')}"
    return ":".join(view.state.environment.split(":")[:2])


def _scanner(view: RunView) -> Vector | None:
    """Return where the laser was when it was read, which the robot may have left; None where the task hides it."""
    poses = None if view.snapshot is None else view.snapshot.poses
    if not poses or view.session.get("task", {}).get("localisation") == "noisy":
        return None
    pose = next((poses[frame] for frame in SCANNERS if frame in poses), None)
    if pose is None:
        return None
    x, y = pose["translation_xyz"][:2]
    return float(x), float(y), float(pose["rotation_rpy"][2])


def endpoints(scans: Points, range_max_m: float, pose_xyyaw: Vector) -> Points:
    """Return where rays (N, 2) of [range in metres, angle in radians] end, (M, 2) in the map frame: those that hit."""
    ranges, angles = np.asarray(scans, float).reshape(-1, 2).T
    hit = np.isfinite(ranges) & (ranges > 0) & (ranges < range_max_m)
    x, y, yaw_rad = pose_xyyaw
    turned = angles[hit] + yaw_rad
    return np.stack([x + ranges[hit] * np.cos(turned), y + ranges[hit] * np.sin(turned)], 1)


class MapsScreen(Screen[None]):
    """Maps side by side, each under its title."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,q,enter", "app.pop_screen", "Back", key_display="esc")]

    def __init__(self, maps: Mapping[str, SceneMap], images: str) -> None:
        super().__init__()
        self._maps = {title: RunMap(cleaned(scene), ZOOMS[0]) for title, scene in maps.items()}
        self._panels = [MapPanel(make(images)) for _ in self._maps]

    def compose(self) -> ComposeResult:
        """Lay out a panel for each."""
        yield Static("  |  ".join(self._maps), classes="bar", markup=False)
        with Horizontal():
            yield from self._panels
        yield Footer()

    def on_mount(self) -> None:
        """Draw them."""
        for number, (panel, run_map) in enumerate(zip(self._panels, self._maps.values(), strict=True)):
            panel.show(run_map, number)
