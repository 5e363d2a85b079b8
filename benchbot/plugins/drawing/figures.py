"""Figures by matplotlib: maps, paths and frames of results, the same bytes for the same result."""

import itertools
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
NEIGHBOURS_M = 0.5
# The height of a line per point of its size.
_LINE_HEIGHT = 1.2
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
    chosen = class_colors(classes, PRINT_CLASSES, _neighbours(scenes))
    colors = {name: to_hex(color) for name, color in chosen.items()}
    for axes, scene, count, title in zip(panels, scenes, counts, _lettered(scenes), strict=True):
        _draw_map(
            axes, scene, colors, [point for other in scenes if other.name == scene.name for point in other.points]
        )
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
    # Where there is room for labels is known once the panels have their size.
    figure.draw_without_rendering()
    for axes, scene in zip(panels, scenes, strict=True):
        _draw_labels(axes, scene, colors)
    return figure


def _neighbours(scenes: Sequence[SceneMap]) -> dict[str, set[str]]:
    """Return for each class those of which something stands next to something of it, seen from above."""
    found: dict[str, set[str]] = {}
    for scene in scenes:
        for (name, box), (other, beside) in itertools.combinations(scene.estimates, 2):
            apart = (max(box.low[i] - beside.high[i], beside.low[i] - box.high[i]) for i in (0, 1))
            if name != other and max(apart) < NEIGHBOURS_M:
                found.setdefault(name, set()).add(other)
                found.setdefault(other, set()).add(name)
    return found


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


def _draw_map(axes: "Axes", scene: SceneMap, colors: Mapping[str, str], points: Sequence[Point]) -> None:
    """Draw a map without labels; it shows all of `points`, so that several maps of a place are alike."""
    _draw_floor(axes, scene)
    for _, box in scene.truth:
        _draw_box(axes, box, facecolor=TRUTH_FILL, edgecolor=TRUTH_LINE, linewidth=0.6, zorder=2)
    if scene.path.points:
        _draw_path(axes, scene.path.points)
    for label, box in scene.estimates:
        _draw_box(axes, box, facecolor="none", edgecolor=colors[label], linewidth=1.2, zorder=5)
    _as_map(axes, points)


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


def _draw_labels(axes: "Axes", scene: SceneMap, colors: Mapping[str, str]) -> None:
    """Write the names of objects into a panel that has its size; none over another."""
    from matplotlib.patheffects import withStroke
    from matplotlib.textpath import TextPath

    (left, right), (_, top) = axes.get_xlim(), axes.get_ylim()
    panel = axes.get_window_extent()
    pt_per_px = 72 / axes.figure.dpi
    frame = Rectangle(0, 0, panel.width * pt_per_px, panel.height * pt_per_px)
    transform = MapTransform(frame, left, top, frame.width / (right - left))
    path = [transform.point(x, y) for x, y in scene.path.points[::10]]

    def size(text: str) -> tuple[float, float]:
        # The white edge around letters hides as they do.
        return TextPath((0, 0), text, size=LABEL_PT).get_extents().width + 2.0, LABEL_PT * _LINE_HEIGHT

    for label in place_labels(scene.objects, transform, size, path, 0.4, 0.0):
        color = colors.get(label.label, FAINT)
        if label.leader is not None:
            start, end = transform.metres(*label.leader[:2]), transform.metres(*label.leader[2:])
            (line,) = axes.plot(*zip(start, end, strict=True), color=color, linewidth=0.5, zorder=6)
            line.set_in_layout(False)
        axes.annotate(
            label.text,
            transform.metres(*label.box.center),
            ha="center",
            va="center",
            fontsize=LABEL_PT,
            color=color,
            path_effects=[withStroke(linewidth=1.2, foreground="white")],
            zorder=7,
        ).set_in_layout(False)


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
    names = [f"{scene.solution}, {scene.name}" if scene.solution else scene.name for scene in scenes]
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
