"""Figures by matplotlib: maps, paths and frames of results, the same bytes for the same result."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing.map_layout import MapTransform, Rectangle, place_labels
from benchbot.plugins.drawing.map_model import Box, Point, SceneMap
from benchbot.plugins.drawing.palette import LIGHT, PRINT_CLASSES, between, class_colors, to_hex

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = (".png", ".svg", ".pdf")
MM_PER_INCH = 25.4
DPI = 300
FONT_PT, SMALL_PT, LABEL_PT = 7.0, 6.0, 4.5
PANEL_MM = 80.0
WIDEST_FRAME_PX = 640
PT_PER_MM = 72 / MM_PER_INCH
# The mean width of a letter of DejaVu Sans, and the height of a line, per point of its size.
_LETTER_WIDTH, _LINE_HEIGHT = 0.6, 1.2
INK, FAINT, TRUTH_FILL, TRUTH_LINE, PATH, MISSED = map(
    to_hex, (LIGHT.ink, LIGHT.faint, LIGHT.truth_fill, LIGHT.truth_line, LIGHT.path, LIGHT.missed)
)
WALL = to_hex(between(LIGHT.wall, (255, 255, 255), 0.5))

# Editable, embedded letters in PDF; outlines in SVG, which look the same wherever it is opened.
_STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": FONT_PT,
    "axes.titlesize": FONT_PT,
    "axes.titlecolor": INK,
    "legend.fontsize": SMALL_PT,
    "axes.linewidth": 0.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "benchbot",
    "text.parse_math": False,  # a dollar in a name is one
}


@contextmanager
def style() -> Iterator[None]:
    """Draw within as all figures are drawn; raises BenchbotError without matplotlib."""
    try:
        import matplotlib as mpl
    except ImportError as error:
        raise BenchbotError(
            "Figures need matplotlib.",
            f"It cannot be imported: {error}.",
            "Install it: pip install 'benchbot[viz]'",
        ) from error
    with mpl.rc_context(_STYLE):  # type: ignore[arg-type, unused-ignore]
        yield


def save(figure: "Figure", path: Path) -> None:
    """Write a figure, the same bytes each time; raises BenchbotError for another ending and when it cannot be."""
    if path.suffix.lower() not in FORMATS:
        raise BenchbotError(
            f"A figure cannot be written as '{path.name}'.",
            f"Its name ends in '{path.suffix}'.",
            f"Choose a name that ends in one of: {', '.join(FORMATS)}",
        )
    undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix.lower(), {})
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=DPI, metadata=undated)
    except OSError as error:
        raise BenchbotError(
            f"Cannot write {path}.", f"{error.strerror or error}.", "Choose a folder that you may write to."
        ) from error


def draw_maps(scenes: Sequence[SceneMap], width_mm: float) -> "Figure":
    """Return the figure of maps, side by side: truth filled with grey, estimates as outlines by class."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure, panels = _panels(len(scenes), width_mm, min(PANEL_MM, width_mm) + 14)
    counts = [len(scene.objects) for scene in scenes]
    scenes = [scene.without_far() for scene in scenes]
    classes = {label for scene in scenes for label, _ in scene.estimates}
    colors = {name: to_hex(color) for name, color in class_colors(classes, PRINT_CLASSES).items()}
    for axes, scene, count, title in zip(panels, scenes, counts, _lettered(scenes), strict=True):
        _draw_map(axes, scene, colors, min(PANEL_MM, width_mm / len(scenes)) * PT_PER_MM)
        outside = count - len(scene.objects)
        axes.set_title(f"{title}\n{outside} estimated far outside" if outside else title)
    handles: list[Patch | Line2D] = []
    if any(scene.truth for scene in scenes):
        handles.append(Patch(facecolor=TRUTH_FILL, edgecolor=TRUTH_LINE, linewidth=0.6, label="truth"))
    if any(scene.path.points for scene in scenes):
        driven = all(scene.path.recorded for scene in scenes)
        handles.append(Line2D([], [], color=PATH, linewidth=0.9, label="way" if driven else "planned way"))
    handles += [Patch(facecolor="none", edgecolor=color, linewidth=1.2, label=name) for name, color in colors.items()]
    if handles:
        columns = max(3, int(width_mm // 22))
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), columns), frameon=False)
    return figure


def draw_paths(scenes: Sequence[SceneMap], width_mm: float) -> "Figure":
    """Return the figure of paths, side by side; the estimate is fitted to the truth, moved and turned as a whole."""
    figure, panels = _panels(len(scenes), width_mm, min(PANEL_MM, width_mm) + 8)
    handles: dict[str, Artist] = {}
    for axes, scene, title in zip(panels, scenes, _lettered(scenes), strict=True):
        _draw_floor(axes, scene)
        points = replace(scene, objects=(), goals=()).points
        if scene.path.points:
            name = "true way" if scene.path.recorded else "planned way"
            handles[name], *ends = _draw_path(axes, scene.path.points, name)
            handles |= dict(zip(("start", "end"), ends, strict=True))
        if scene.believed is not None and len(scene.believed):
            name = "estimate (fitted)"
            (handles[name],) = axes.plot(
                *scene.believed.T, color=MISSED, linewidth=0.9, linestyle=(0, (4, 1.5)), zorder=4, label=name
            )
            points += [(float(x), float(y)) for x, y in scene.believed]
        _as_map(axes, points)
        axes.set_title(title)
    if handles:
        figure.legend(handles=list(handles.values()), loc="outside lower center", ncols=5, frameon=False)
    return figure


def draw_frames(frames: Mapping[int, Path], width_mm: float, columns: int) -> "Figure":
    """Return the contact sheet of frames, row by row, each with its number, counted from 1 as observations are."""
    pictures = {number: _read(path) for number, path in frames.items()}
    height, width = next(iter(pictures.values())).shape[:2]
    across = min(columns, len(pictures))
    figure, panels = _panels(len(pictures), width_mm, width_mm / across * height / width + 1, across)
    figure.get_layout_engine().set(w_pad=0.01, h_pad=0.01, wspace=0.0, hspace=0.0)  # type: ignore[union-attr, call-arg]
    for axes, (number, picture) in zip(panels, pictures.items(), strict=True):
        axes.imshow(picture)
        axes.set_axis_off()
        axes.text(
            0.02,
            0.97,
            str(number + 1),
            transform=axes.transAxes,
            ha="left",
            va="top",
            fontsize=SMALL_PT,
            color="white",
            bbox={"boxstyle": "round,pad=0.25", "facecolor": INK, "edgecolor": "none", "alpha": 0.75},
        )
    return figure


def _read(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        image.thumbnail((WIDEST_FRAME_PX, WIDEST_FRAME_PX))
        return np.asarray(image.convert("RGB"))


def _draw_map(axes: "Axes", scene: SceneMap, colors: Mapping[str, str], side_pt: float) -> None:
    _draw_floor(axes, scene)
    for _, box in scene.truth:
        _draw_box(axes, box, facecolor=TRUTH_FILL, edgecolor=TRUTH_LINE, linewidth=0.6, zorder=2)
    if scene.path.points:
        _draw_path(axes, scene.path.points)
    for label, box in scene.estimates:
        _draw_box(axes, box, facecolor="none", edgecolor=colors[label], linewidth=1.2, zorder=5)
    _as_map(axes, scene.points)
    _draw_labels(axes, scene, colors, side_pt)


def _draw_floor(axes: "Axes", scene: SceneMap) -> None:
    if scene.occupancy is None:
        return
    from matplotlib.colors import ListedColormap

    (left, bottom), (right, top) = scene.occupancy.low, scene.occupancy.high
    axes.imshow(
        scene.occupancy.occupied,
        cmap=ListedColormap(["#ffffff", WALL]),
        vmin=0,
        vmax=1,
        extent=(left, right, bottom, top),
        interpolation="nearest",
        zorder=0,
    )


def _draw_path(axes: "Axes", points: Sequence[Point], label: str = "") -> "list[Artist]":
    """Draw a path with its start and its end; return the three."""
    xs, ys = zip(*points, strict=True)
    return [
        *axes.plot(xs, ys, color=PATH, linewidth=1.0, zorder=3, label=label),
        *axes.plot(xs[0], ys[0], "o", color="white", markeredgecolor=PATH, markersize=4, zorder=6, label="start"),
        *axes.plot(xs[-1], ys[-1], "s", color=PATH, markersize=3.2, zorder=6, label="end"),
    ]


def _draw_box(axes: "Axes", box: Box, **look: Any) -> None:
    from matplotlib.patches import Rectangle as Patch

    axes.add_patch(Patch(box.low, box.extent[0], box.extent[1], **look))


def _draw_labels(axes: "Axes", scene: SceneMap, colors: Mapping[str, str], side_pt: float) -> None:
    """Write the names of objects, placed in points (1/72 inch), for a map whose longer side is about `side_pt` long."""
    from matplotlib.patheffects import withStroke

    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    scale = side_pt / max(right - left, top - bottom)
    frame = Rectangle(0, 0, (right - left) * scale, (top - bottom) * scale)
    transform = MapTransform(frame, left, top, scale)
    path = [transform.point(x, y) for x, y in scene.path.points[::10]]

    def size(text: str) -> tuple[float, float]:
        return LABEL_PT * _LETTER_WIDTH * len(text), LABEL_PT * _LINE_HEIGHT

    for label in place_labels(scene.objects, transform, size, path, 0.4):
        color = colors.get(label.label, FAINT)
        if label.leader is not None:
            start, end = transform.metres(*label.leader[:2]), transform.metres(*label.leader[2:])
            axes.plot(*zip(start, end, strict=True), color=color, linewidth=0.5, zorder=6)
        axes.annotate(
            label.text,
            transform.metres(*label.box.center),
            ha="center",
            va="center",
            fontsize=LABEL_PT,
            color=color,
            path_effects=[withStroke(linewidth=1.2, foreground="white")],
            zorder=7,
        )


def _panels(count: int, width_mm: float, height_mm: float, columns: int | None = None) -> "tuple[Figure, list[Axes]]":
    """Return a figure of so many panels, and them, in order; `height_mm` is that of one row."""
    from matplotlib.figure import Figure

    across = min(count, columns or count)
    rows = -(-count // across)
    figure = Figure(figsize=(width_mm / MM_PER_INCH, rows * height_mm / MM_PER_INCH), layout="constrained")
    drawn = [figure.add_subplot(rows, across, number + 1) for number in range(count)]
    return figure, drawn


def _lettered(scenes: Sequence[SceneMap]) -> list[str]:
    """Return the titles of panels, with a letter each where there are several, which a caption can refer to."""
    names = [scene.name for scene in scenes]
    return names if len(names) < 2 else [f"({chr(97 + n % 26)}) {name}" for n, name in enumerate(names)]


def _as_map(axes: "Axes", points: Sequence[Point]) -> None:
    """Make a panel a map of these places with some room around: as long as wide, a scale bar instead of axes."""
    axes.set_aspect("equal", adjustable="box")
    axes.set_xticks([])
    axes.set_yticks([])
    for side in axes.spines.values():
        side.set_visible(False)
    if points:
        xs, ys = zip(*points, strict=True)
        room = 0.04 * max(max(xs) - min(xs), max(ys) - min(ys), 0.5)
        axes.set_xlim(min(xs) - room, max(xs) + room)
        axes.set_ylim(min(ys) - 3 * room, max(ys) + room)
    _scale_bar(axes)


def scale_length_m(width_m: float) -> float:
    """Return a round length, of 1, 2 or 5 times a power of ten: the longest that is at most a quarter of a width."""
    power = 10.0 ** math.floor(math.log10(max(width_m, 1e-3) / 4))
    return max((step * power for step in (1, 2, 5) if step * power <= width_m / 4), default=power)


def _scale_bar(axes: "Axes") -> None:
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    length = scale_length_m(right - left)
    x, y = left + 0.02 * (right - left), bottom + 0.035 * (top - bottom)
    axes.plot([x, x + length], [y, y], color=INK, linewidth=1.6, solid_capstyle="butt", clip_on=False)
    words = f"{length:g} m" if length >= 1 else f"{100 * length:g} cm"
    axes.text(x + length / 2, y + 0.008 * (top - bottom), words, ha="center", va="bottom", fontsize=SMALL_PT, color=INK)
