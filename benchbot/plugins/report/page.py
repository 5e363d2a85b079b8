"""The page: one HTML file that needs no other, no network and no script."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

import benchbot
from benchbot.plugins.drawing.camera import Box, Camera
from benchbot.plugins.drawing.driven import Way, ways
from benchbot.plugins.drawing.episodes import Episode, Material, grouped
from benchbot.plugins.drawing.floors import floor_of
from benchbot.plugins.drawing.objects import FALSE_NEGATIVE, FALSE_POSITIVE, WORDS, Thing, by_class, goals_of, things_of
from benchbot.plugins.drawing.recorded_frames import Frame, frames_of
from benchbot.plugins.report import origin, summary
from benchbot.plugins.report.bars import axis_of, bar_of
from benchbot.plugins.report.maps import Drawing, draw
from benchbot.plugins.report.pictures import Budget, Outline, best_frame, crop, thumbnail

MOST_CARDS, MOST_ROWS = 12, 120
FEWEST_CARDS, GOOD_QUALITY = 4, 0.9
"""Where fewer objects than this failed, the worst of those that were found are shown, too, if they are not good."""
MOST_OPEN = 5
"""Of more environments than this, one of each place is shown openly."""
_FRAMES = 3
_TRUTH_LINE, _PROPOSAL_LINE = (255, 236, 160), (120, 215, 255)


@dataclass(frozen=True)
class Card:
    """What went wrong, or worst, its picture (None without one) and what that shows."""

    thing: Thing
    picture: str | None
    alt: str


@dataclass(frozen=True)
class SceneView:
    """One scene of an episode: its name, its map, and some of what the camera saw."""

    name: str
    way: Way
    drawing: Drawing | None
    pictures: list[str]


@dataclass(frozen=True)
class EpisodeView:
    """Everything that is shown of one scored episode."""

    episode: Episode
    scenes: list[SceneView]
    things: list[Thing]
    cards: list[Card]

    @property
    def counts(self) -> list[tuple[int, str]]:
        """How many objects there are of each verdict, and its word."""
        numbers = [(sum(thing.verdict == verdict for thing in self.things), word) for verdict, word in WORDS.items()]
        return [(number, word) for number, word in numbers if number]


@dataclass(frozen=True)
class Look:
    """One environment: its score (None when nothing counts) and what is shown of its episodes, one of them openly."""

    name: str
    value: float | None
    views: list[EpisodeView]


@dataclass(frozen=True)
class Place:
    """The environments of a place, and how many of them are shown openly."""

    name: str
    looks: list[Look]
    open: int


def html(material: Material) -> str:
    """Return the report as one self-contained HTML page, the same bytes for the same material."""
    axis = axis_of(material)
    budget = Budget()
    views = _views(material, budget)
    style = _style()
    found = origin.distributions(material)
    places = _places(material, views)
    return (
        _templates()
        .get_template("page.html")
        .render(
            arrow=summary.arrow,
            arrows=summary.arrows_in_words(material),
            axis=axis,
            bars=[bar_of(name, episodes, material, axis) for name, episodes in material.environments.items()],
            budget=budget,
            command=origin.command,
            coverage=material.scores["coverage"],
            distributions=found,
            drives=origin.drives(material),
            environments=summary.environments_in_words(material),
            failures=summary.failures(material),
            has_variants=any(len(place.looks) > 1 for place in places),
            interval=summary.interval,
            missing_in_words=summary.missing_in_words(material),
            reading=summary.reading,
            material=material,
            method=material.scores["method"],
            mixed=origin.mixed(found),
            most_rows=MOST_ROWS,
            revision=origin.revision,
            robots=summary.robots(material),
            statistics=material.scores.get("statistics") or {},
            style=style,
            style_hash=base64.b64encode(sha256(style.encode()).digest()).decode(),
            tallies=by_class(thing for shown in views.values() for view in shown for thing in view.things),
            task=summary.task(material),
            places=places,
            title=summary.title(material),
            variables=summary.variables(material, axis),
            version=benchbot.__version__,
            words=WORDS,
        )
    )


def _views(material: Material, budget: Budget) -> dict[str, list[EpisodeView]]:
    """Return what is shown of each environment: the first of its episodes openly, the others folded.

    The pictures of the first ones are taken first, so that it is the folded ones for which there may be no more room.
    """
    shown = {name: summary.shown_first(episodes, material.headline) for name, episodes in material.environments.items()}
    views = {name: [_view(episode, material, budget) for episode in episodes[:1]] for name, episodes in shown.items()}
    for name, episodes in shown.items():
        views[name] += [_view(episode, material, budget) for episode in episodes[1:]]
    return views


def _places(material: Material, views: dict[str, list[EpisodeView]]) -> list[Place]:
    """Return the places; of many environments the worst one of each place comes first, and only that is open."""
    sign = -1.0 if material.evaluator.score(material.headline).lower_is_better else 1.0
    found = []
    for place, episodes in grouped(material.episodes, lambda episode: episode.place).items():
        names = dict.fromkeys(episode.environment for episode in episodes)
        values = {name: material.combined(material.environments[name]).get(material.headline) for name in names}
        looks = [Look(name, value, views[name]) for name, value in values.items()]
        is_open = len(material.environments) <= MOST_OPEN
        if not is_open:
            looks.sort(key=lambda look: (not look.views, sign * (look.value or 0.0)))
        found.append(Place(place, looks, len(looks) if is_open else 1))
    return found


def _view(episode: Episode, material: Material, budget: Budget) -> EpisodeView:
    things, found = things_of(episode), ways(episode)
    frames = frames_of(episode, material)
    camera = Camera.of(material.robot(episode.robot) if episode.robot else None)
    scenes = []
    for number, scene in enumerate(episode.scenes):
        way = found[number] if number < len(found) else Way((), (), recorded=False)
        seen = _spread([frame for frame in frames if frame.scene == number])
        pictures = [(frame, thumbnail(frame, budget)) for frame in seen]
        shown = [(frame, uri) for frame, uri in pictures if uri is not None]
        on_floor = [thing for thing in things if thing.scene == number]
        name = f"{scene.get('name')}:{scene.get('variant')}"
        # Other models stand elsewhere.
        floor = None if "assets=" in episode.settings else floor_of(material.scene(name))
        if floor is not None and not budget.takes(len(floor.picture)):
            floor = None
        drawing = draw(on_floor, way, [frame.base for frame, _ in shown], goals_of(episode), floor)
        scenes.append(SceneView(name, way, drawing, [uri for _, uri in shown]))
    cards = [_card(thing, things, frames, camera, budget) for thing in _worst(things)]
    return EpisodeView(episode, scenes, things, cards)


def _worst(things: Sequence[Thing]) -> list[Thing]:
    """Return what failed and, where that is little, what was found worst."""
    failed = [thing for thing in things if thing.failed][:MOST_CARDS]
    found = [thing for thing in things if thing.quality is not None and thing.quality < GOOD_QUALITY]
    return failed + found[: max(FEWEST_CARDS - len(failed), 0)]


def _spread(frames: Sequence[Frame]) -> list[Frame]:
    """Return some of the frames, evenly spread, neither the first nor the last."""
    return [frames[(2 * i + 1) * len(frames) // (2 * _FRAMES)] for i in range(_FRAMES)] if len(frames) > _FRAMES else []


def _card(
    thing: Thing, things: Sequence[Thing], frames: Sequence[Frame], camera: Camera | None, budget: Budget
) -> Card:
    box = thing.true or thing.proposed
    if camera is None or box is None:
        return Card(thing, None, "")
    others = [other.true for other in things if other.scene == thing.scene and _hides(other.true, box)]
    frame = best_frame(frames, camera, box, thing.scene, [other for other in others if other is not None])
    if frame is None:
        return Card(thing, None, "")
    boxes = ((thing.true, _TRUTH_LINE), (thing.proposed, _PROPOSAL_LINE))
    outlines: list[Outline] = [(shown, color) for shown, color in boxes if shown is not None]
    what = "boxes are" if len(outlines) > 1 else "box is"
    alt = f"What the camera saw where {thing.name} {_there(thing)}; its {what} outlined."
    return Card(thing, crop(frame, camera, outlines, budget), alt)


def _hides(other: Box | None, box: Box) -> bool:
    """Say whether another box may stand before this one; what it touches or stands on does not."""
    if other is None or other == box:
        return False
    return any(
        abs(other.centroid[i] - box.centroid[i]) > (other.extent[i] + box.extent[i]) / 2 + 0.02 for i in range(2)
    )


def _there(thing: Thing) -> str:
    said = {FALSE_NEGATIVE: "stands and was missed", FALSE_POSITIVE: "was reported and is not there"}
    return said.get(thing.verdict or "", "was found")


def _number(value: float | None, digits: int = 3) -> str:
    """Return a number with a true minus sign; a dash for none."""
    return "–" if value is None else f"{value:.{digits}f}".replace("-", "−")


def _breakable(text: str) -> Markup:
    """Return a text that may be broken after underscores and colons, as long names of programs are."""
    safe = str(Markup.escape(text))
    return Markup(safe.replace("_", "_<wbr>").replace(":", ":<wbr>"))  # noqa: S704 (escaped above)


@cache
def _templates() -> Environment:
    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = _number
    environment.filters["breakable"] = _breakable
    return environment


def _style() -> str:
    return (Path(__file__).parent / "templates" / "style.css").read_text("utf-8")
