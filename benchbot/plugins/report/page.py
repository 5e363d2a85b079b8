"""The page: one HTML file that needs no other, no network and no script."""

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from hashlib import sha256
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

import benchbot
from benchbot.core.geometry import Pose
from benchbot.evaluation.frames import Frame
from benchbot.plugins.drawing.map_layout import MARGIN_M, MapLayout, MapTransform, Marker, Rectangle, lay_out
from benchbot.plugins.drawing.map_model import (
    MapObject,
    MapPath,
    Point,
    SceneMap,
    occupancy_of,
)
from benchbot.plugins.drawing.palette import DARK, ESTIMATE_OUTLINE, LIGHT, TRUTH_OUTLINE, to_hex
from benchbot.plugins.report import diagnosis, summary
from benchbot.plugins.report.bars import axis_of, bar_of
from benchbot.plugins.report.camera_pictures import Budget, frames_of, thumbnail
from benchbot.plugins.report.cards import Card, card_of, shots_of, verdict_of, worst
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode, grouped
from benchbot.plugins.report.summary import VERDICTS

MOST_ROWS = 120
MOST_OPEN = 5
"""Of more environments than this, one of each place is shown openly."""
MAP_WIDTH_PX, LEAST_HEIGHT_PX, MOST_HEIGHT_PX = 720, 280, 760
_FRAME_MARGIN_PX = 34
# A digit of a sans-serif of 12 px is about this wide; labels are placed by it, whatever typeface shows them.
_LETTER_PX, _LINE_PX = 6.6, 16
_WEDGE_PX = 30
_FRAMES = 3


@dataclass(frozen=True)
class Drawing:
    """A map as SVG shows it: its layout and height in pixels, and how many estimates lie far outside of it.

    `walls` is the picture of what stands on the floor, as a data URI.
    """

    layout: MapLayout
    height: int
    outside: int
    walls: str | None
    width: int = MAP_WIDTH_PX

    @property
    def kinds(self) -> set[tuple[str, str]]:
        """The roles and kinds of the shapes that there are."""
        return {(shape.role, shape.kind) for shape in self.layout.shapes}


@dataclass(frozen=True)
class SceneView:
    """One scene of an episode: its name, its map, and some of what the camera saw."""

    name: str
    path: MapPath
    drawing: Drawing | None
    pictures: list[str]


@dataclass(frozen=True)
class EpisodeView:
    """All that is shown of one scored episode."""

    episode: ReportedEpisode
    scenes: list[SceneView]
    objects: list[MapObject]
    cards: list[Card]

    @property
    def counts(self) -> list[tuple[int, str]]:
        """The number of objects of each verdict, and its word."""
        numbers = [(sum(item.verdict == verdict for item in self.objects), word) for verdict, word in VERDICTS.items()]
        return [(number, word) for number, word in numbers if number]


@dataclass(frozen=True)
class EnvironmentSection:
    """One environment: its score (None when nothing counts) and what is shown of its episodes, one of them openly."""

    name: str
    value: float | None
    views: list[EpisodeView]


@dataclass(frozen=True)
class PlaceSection:
    """The environments of a place, and how many of them are shown openly."""

    name: str
    environments: list[EnvironmentSection]
    open: int


def html(data: ReportData) -> str:
    """Return the report as one self-contained HTML page, the same bytes for the same data."""
    axis = axis_of(data)
    budget = Budget()
    views = _views(data, budget)
    places = _places(data, views)
    return (
        templates()
        .get_template("page.html")
        .render(
            axis=axis,
            bars=[bar_of(name, episodes, data, axis) for name, episodes in data.environments.items()],
            budget=budget,
            coverage=data.scores["coverage"],
            breakdowns=diagnosis.BREAKDOWNS,
            data=data,
            diagnosis=diagnosis,
            diagnoses=[episode.diagnosis for episode in data.episodes],
            has_variants=any(len(place.environments) > 1 for place in places),
            method=data.scores["method"],
            most_rows=MOST_ROWS,
            places=places,
            statistics=data.scores.get("statistics") or {},
            **styled(),
            summary=summary,
            tallies=summary.by_class(item for shown in views.values() for view in shown for item in view.objects),
            task=data.scores["task_details"],
            title=summary.title(data),
            variables=summary.variables(data, axis),
            version=benchbot.__version__,
        )
    )


def styled() -> dict[str, str]:
    """Return what each page needs for its looks: the style sheet and its hash."""
    outlines = (TRUTH_OUTLINE, ESTIMATE_OUTLINE)
    style = templates().get_template("style.css").render(light=LIGHT, dark=DARK, outlines=outlines)
    return {"style": style, "style_hash": base64.b64encode(sha256(style.encode()).digest()).decode()}


def _views(data: ReportData, budget: Budget) -> dict[str, list[EpisodeView]]:
    """Return what is shown of each environment: the first of its episodes openly, the others folded.

    The pictures of the first ones are taken first, so that it is the folded ones for which there may be no more room.
    """
    shown = {name: summary.shown_first(episodes, data.headline) for name, episodes in data.environments.items()}
    views = {name: [_view(episode, data, budget) for episode in episodes[:1]] for name, episodes in shown.items()}
    for name, episodes in shown.items():
        views[name] += [_view(episode, data, budget) for episode in episodes[1:]]
    return views


def _places(data: ReportData, views: dict[str, list[EpisodeView]]) -> list[PlaceSection]:
    """Return the places; of many environments the worst one of each place comes first, and only that is open."""
    sign = -1.0 if data.evaluator.score(data.headline).lower_is_better else 1.0
    found = []
    for place, episodes in grouped(data.episodes, lambda episode: episode.place).items():
        names = dict.fromkeys(episode.environment for episode in episodes)
        values = {name: data.combined(data.environments[name]).get(data.headline) for name in names}
        sections = [EnvironmentSection(name, value, views[name]) for name, value in values.items()]
        is_open = len(data.environments) <= MOST_OPEN
        if not is_open:
            sections.sort(key=lambda section: (not section.views, sign * (section.value or 0.0)))
        found.append(PlaceSection(place, sections, len(sections) if is_open else 1))
    return found


def _view(episode: ReportedEpisode, data: ReportData, budget: Budget) -> EpisodeView:
    objects = episode.objects
    frames = frames_of(episode, data)
    scenes = []
    for number, scene in enumerate(episode.scenes):
        seen = _spread([frame for frame in frames if frame.scene == number])
        pictures = [(frame, thumbnail(frame, budget)) for frame in seen]
        shown = [(frame, uri) for frame, uri in pictures if uri is not None]
        name = f"{scene.get('name')}:{scene.get('variant')}"
        drawing = draw(scene_map(episode, data, number), [frame.base for frame, _ in shown], budget)
        scenes.append(SceneView(name, _path(episode, number), drawing, [uri for _, uri in shown]))
    shots = shots_of(episode, data, frames)
    cards = [card_of(item, shots.get, budget) for item in worst(objects)]
    return EpisodeView(episode, scenes, objects, cards)


def scene_map(episode: ReportedEpisode, data: ReportData, number: int) -> SceneMap:
    """Return the map of one scene of an episode."""
    scene = episode.scenes[number]
    name = f"{scene.get('name')}:{scene.get('variant')}"
    # Other models stand elsewhere.
    occupancy = None if "assets=" in episode.settings else occupancy_of(data.catalog.find("environments", name))
    on_floor = tuple(item for item in episode.objects if item.scene == number)
    return SceneMap(name, occupancy, on_floor, _path(episode, number), goals=episode.goals)


def _path(episode: ReportedEpisode, number: int) -> MapPath:
    paths = episode.paths
    return paths[number] if number < len(paths) else MapPath()


def draw(
    scene: SceneMap, pictures: Sequence[Pose], budget: Budget, points: Sequence[Point] | None = None
) -> Drawing | None:
    """Return the map of one scene, None when there is nothing to show; `pictures` are the poses where some were taken.

    It shows `points`, if they are given, so that several maps are alike. The walls are left out when the budget has no
    room for their picture.
    """
    near = scene.without_far()
    if not (near.objects or near.path.points or near.goals):
        return None
    png = None if scene.occupancy is None else scene.occupancy.png(LIGHT.wall)
    if png is not None and not budget.takes(len(png)):
        png, near = None, replace(near, occupancy=None)
    shown = near.points if points is None else points
    wide_m, tall_m = (max(values) - min(values) + 2 * MARGIN_M for values in zip(*shown, strict=True))
    height = round(min(max((MAP_WIDTH_PX - _FRAME_MARGIN_PX) * tall_m / wide_m, LEAST_HEIGHT_PX), MOST_HEIGHT_PX))
    frame = Rectangle(_FRAME_MARGIN_PX, 8, MAP_WIDTH_PX - 8, height - 24)
    layout = lay_out(near, MapTransform.fit(frame, shown), _label_size, pictures)
    walls = None if png is None else "data:image/png;base64," + base64.b64encode(png).decode()
    return Drawing(layout, height, len(scene.objects) - len(near.objects), walls)


def _label_size(text: str) -> tuple[float, float]:
    return len(text) * _LETTER_PX + 4, _LINE_PX


def _wedge(marker: Marker) -> str:
    """Return the SVG path of the sector that a camera looks into."""
    x, y = marker.point
    (x0, y0), (x1, y1) = (
        (x + _WEDGE_PX * math.cos(marker.yaw_rad + turn), y - _WEDGE_PX * math.sin(marker.yaw_rad + turn))
        for turn in (-math.pi / 4, math.pi / 4)
    )
    return f"M{x:.1f},{y:.1f}L{x0:.1f},{y0:.1f}A{_WEDGE_PX},{_WEDGE_PX} 0 0 0 {x1:.1f},{y1:.1f}Z"


def _spread(frames: Sequence[Frame]) -> list[Frame]:
    """Return some of the frames, evenly spread, neither the first nor the last."""
    return [frames[(2 * i + 1) * len(frames) // (2 * _FRAMES)] for i in range(_FRAMES)] if len(frames) > _FRAMES else []


def _number(value: float | None, digits: int = 3) -> str:
    """Return a number with a true minus sign; a dash for none."""
    return "–" if value is None else f"{value:.{digits}f}".replace("-", "−")


def _breakable(text: str) -> Markup:
    """Return a text that may be broken after underscores and colons, as long names of programs are."""
    safe = str(Markup.escape(text))
    return Markup(safe.replace("_", "_<wbr>").replace(":", ":<wbr>"))  # noqa: S704 (escaped above)


@cache
def templates() -> Environment:
    """Return the templates of all pages."""
    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"breakable": _breakable, "color": to_hex, "number": _number}
    environment.filters |= {"verdict": verdict_of, "wedge": _wedge}
    return environment
