"""A top-down map as an SVG drawing: true and estimated objects, the robot's way, where pictures were taken."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.camera import Box
from benchbot.plugins.drawing.driven import Way
from benchbot.plugins.drawing.floors import Floor
from benchbot.plugins.drawing.label_placement import Rectangle, legible, place
from benchbot.plugins.drawing.map_drawing import Thing as Footprint
from benchbot.plugins.drawing.map_drawing import View
from benchbot.plugins.drawing.objects import FALSE_NEGATIVE, FALSE_POSITIVE, IGNORED, MATCH, Thing

WIDTH = 720
LEAST_HEIGHT, MOST_HEIGHT = 280, 760
MOST_LABELS = 80
_FRAME_MARGIN = 34
_ROOM_M = 0.35
_FAR_M = 5.0
# A digit of a sans-serif of 12 px is about this wide; labels are placed by it, whatever typeface shows them.
_LETTER_PX, _LINE_PX = 6.6, 16
_PATH_POINTS = 80
_KINDS = {MATCH: "found", FALSE_POSITIVE: "extra", FALSE_NEGATIVE: "missed", IGNORED: "ignored", None: "plain"}


@dataclass(frozen=True)
class Shape:
    """A box from above, in pixels: `role` is `truth` or `proposal`, `kind` what became of the object."""

    role: str
    kind: str
    x: float
    y: float
    width: float
    height: float
    title: str


@dataclass(frozen=True)
class Label:
    """A name beside its box, and the line that leads to it when it stands apart."""

    text: str
    kind: str
    x: float
    y: float
    leader: tuple[float, float, float, float] | None


@dataclass(frozen=True)
class Marker:
    """Where a picture was taken, the direction as a wedge."""

    number: int
    x: float
    y: float
    wedge: str


@dataclass(frozen=True)
class Walls:
    """The picture of what stands on the floor, and where it lies."""

    x: float
    y: float
    width: float
    height: float
    data_uri: str


@dataclass(frozen=True)
class Drawing:
    """Everything of a map, in pixels of its own; x right, y down."""

    height: int
    frame: tuple[float, float, float, float]
    columns: list[tuple[float, str]]
    rows: list[tuple[float, str]]
    shapes: list[Shape]
    labels: list[Label]
    path: str
    start: tuple[float, float] | None
    end: tuple[float, float] | None
    markers: list[Marker]
    goals: list[tuple[float, float]]
    walls: Walls | None
    outside: int
    width: int = WIDTH

    @property
    def kinds(self) -> set[tuple[str, str]]:
        """The roles and kinds of the shapes that there are."""
        return {(shape.role, shape.kind) for shape in self.shapes}


def draw(
    things: Sequence[Thing],
    way: Way,
    pictures: Sequence[Pose] = (),
    goals: Sequence[tuple[float, float]] = (),
    floor: Floor | None = None,
) -> Drawing | None:
    """Return the map of one scene, None when there is nothing to show. `pictures` are numbered from 1."""
    shown, outside = _near(things, way)
    boxes = [box for thing in shown for box in (thing.true, thing.proposed) if box is not None]
    corners = [corner for box in boxes for corner in (_footprint(box).lower, _footprint(box).upper)]
    points = [*corners, *way.points, *goals]
    if not points:
        return None
    points += [floor.low, floor.high] if floor is not None else []
    height = _height(points)
    paper = Rectangle(_FRAME_MARGIN, 8, WIDTH - 8, height - 24)
    view = View.of(paper, points, _ROOM_M)
    # The largest are drawn first, so that small things lie on top.
    shapes = [shape for thing in sorted(shown, key=_area, reverse=True) for shape in _shapes(thing, view)]
    path = [view.point(x, y) for x, y in way.points]
    columns, rows = _grid(view)
    return Drawing(
        height=height,
        frame=_rounded(paper.left, paper.top, paper.right - paper.left, paper.bottom - paper.top),
        columns=columns,
        rows=rows,
        shapes=[shape for role in ("truth", "proposal") for shape in shapes if shape.role == role],
        labels=_labels(shown, view, path),
        path=" ".join(f"{x:.1f},{y:.1f}" for x, y in path),
        start=path[0] if path else None,
        end=path[-1] if len(path) > 1 else None,
        markers=[_marker(number, pose, view) for number, pose in enumerate(pictures, 1)],
        goals=[view.point(x, y) for x, y in goals],
        walls=None if floor is None else _walls(floor, view),
        outside=outside,
    )


def _walls(floor: Floor, view: View) -> Walls:
    place_ = view.box(Footprint("", floor.low, floor.high))
    return Walls(
        *_rounded(place_.left, place_.top, place_.right - place_.left, place_.bottom - place_.top), floor.data_uri
    )


def _near(things: Sequence[Thing], way: Way) -> tuple[list[Thing], int]:
    """Return what lies near the true objects and the robot's way, and how many proposals lie far outside."""
    things = [thing for thing in things if _footprints(thing)]
    anchors = [(thing.true.centroid[0], thing.true.centroid[1]) for thing in things if thing.true is not None]
    anchors += way.points
    if not anchors:
        anchors = [
            (box.centroid[0], box.centroid[1]) for box in _proposals(things) if max(map(abs, box.centroid)) < 1e4
        ]
    if not anchors:
        return [], len(things)
    reach = [(min(values) - _FAR_M, max(values) + _FAR_M) for values in zip(*anchors, strict=True)]
    shown = [thing for thing in things if thing.proposed is None or _inside(thing.proposed, reach)]
    return shown, len(things) - len(shown)


def _proposals(things: Iterable[Thing]) -> list[Box]:
    return [thing.proposed for thing in things if thing.proposed is not None]


def _inside(box: Box, reach: Sequence[tuple[float, float]]) -> bool:
    lower, upper = _footprint(box).lower, _footprint(box).upper
    return all(low <= lower[i] and upper[i] <= high for i, (low, high) in enumerate(reach))


def _footprint(box: Box) -> Footprint:
    return Footprint.of({"centroid": box.centroid, "extent": box.extent}, "")


def _footprints(thing: Thing) -> list[Footprint]:
    return [_footprint(box) for box in (thing.proposed, thing.true) if box is not None]


def _area(thing: Thing) -> float:
    return max(footprint.area for footprint in _footprints(thing))


def _height(points: Sequence[tuple[float, float]]) -> int:
    xs, ys = [x for x, _ in points], [y for _, y in points]
    wide, tall = max(xs) - min(xs) + 2 * _ROOM_M, max(ys) - min(ys) + 2 * _ROOM_M
    return round(min(max((WIDTH - _FRAME_MARGIN) * tall / wide, LEAST_HEIGHT), MOST_HEIGHT))


def _shapes(thing: Thing, view: View) -> list[Shape]:
    found = []
    for role, box in (("truth", thing.true), ("proposal", thing.proposed)):
        if box is not None:
            place_ = view.box(_footprint(box))
            corners = _rounded(place_.left, place_.top, place_.right - place_.left, place_.bottom - place_.top)
            found.append(Shape(role, _KINDS[thing.verdict], *corners, title=_title(thing, role)))
    return found


def _title(thing: Thing, role: str) -> str:
    name = (thing.truth_label if role == "truth" else thing.label) or "object"
    return f"{name}: {thing.why}" if thing.why else name


def _labels(things: Sequence[Thing], view: View, path: Sequence[tuple[float, float]]) -> list[Label]:
    """Name the failures first, then the worst; where there is no more room for a name, a thing has none."""
    named = sorted(things, key=lambda thing: not thing.failed)[:MOST_LABELS]
    boxes = [view.box(max(_footprints(thing), key=lambda footprint: footprint.area)) for thing in named]
    sizes = [(len(_short(thing.name)) * _LETTER_PX + 4, float(_LINE_PX)) for thing in named]
    labels = []
    kept_free = path[:: len(path) // _PATH_POINTS + 1]
    spots = place(boxes, sizes, kept_free, view.frame)
    for thing, box, spot, fits in zip(named, boxes, spots, legible(spots), strict=True):
        if not fits:
            continue
        start = box.nearest(*spot.center)
        end = spot.nearest(*start)
        leader = _rounded(*start, *end) if math.dist(start, end) > 7 else None
        x, y, *_ = _rounded(*spot.center, 0, 0)
        labels.append(Label(_short(thing.name), _KINDS[thing.verdict], x, y, leader))
    return labels


def _short(text: str) -> str:
    return text if len(text) <= 24 else f"{text[:23]}…"


def _marker(number: int, pose: Pose, view: View) -> Marker:
    x, y = view.point(pose.translation_xyz[0], pose.translation_xyz[1])
    radius = 30
    ends = [
        (x + radius * math.cos(pose.yaw_rad + turn), y - radius * math.sin(pose.yaw_rad + turn))
        for turn in (-math.pi / 4, math.pi / 4)
    ]
    (x0, y0), (x1, y1) = ends
    wedge = f"M{x:.1f},{y:.1f}L{x0:.1f},{y0:.1f}A{radius},{radius} 0 0 0 {x1:.1f},{y1:.1f}Z"
    return Marker(number, round(x, 1), round(y, 1), wedge)


def _grid(view: View) -> tuple[list[tuple[float, str]], list[tuple[float, str]]]:
    """Return where the lines of a grid in metres run, and their names."""
    frame = view.frame
    wide_m = (frame.right - frame.left) / view.pixels_per_m
    step = next(step for step in (1, 2, 5, 10, 20, 50, 100, 1000, 10**9) if wide_m / step <= 9)
    right_m = view.left_m + wide_m
    bottom_m = view.top_m - (frame.bottom - frame.top) / view.pixels_per_m
    xs = range(math.ceil(view.left_m / step) * step, math.floor(right_m) + 1, step)
    ys = range(math.ceil(bottom_m / step) * step, math.floor(view.top_m) + 1, step)
    return (
        [(round(view.point(x, 0)[0], 1), f"{x} m") for x in xs],
        [(round(view.point(0, y)[1], 1), f"{y} m") for y in ys],
    )


def _rounded(a: float, b: float, c: float, d: float) -> tuple[float, float, float, float]:
    return (round(a, 1), round(b, 1), round(c, 1), round(d, 1))
