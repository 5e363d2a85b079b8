"""A map from above: what stands there, what a solution has found, and the way that the robot went."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from benchbot.plugins.drawing import figure
from benchbot.plugins.drawing.camera import Box
from benchbot.plugins.drawing.material import Labelled, SceneMaterial
from benchbot.plugins.drawing.occupancy import Occupancy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PANEL_MM = 80.0
MM_PER_PT = 0.353
LABEL_PT = figure.SMALL_PT - 1.5


def draw(scenes: Sequence[SceneMaterial], width_mm: float) -> "Figure":
    """Return the figure of maps, side by side: truth filled with grey, what was proposed as outlines by class."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    drawn, panels = figure.panels(len(scenes), width_mm, min(PANEL_MM, width_mm) + 14)
    names = sorted({label for scene in scenes for label, _ in scene.proposed})
    colours = {name: figure.COLOURS[number % len(figure.COLOURS)] for number, name in enumerate(names)}
    titles = figure.lettered([scene.title for scene in scenes])
    for axes, scene, title in zip(panels, scenes, titles, strict=True):
        _map(axes, scene, colours, width_mm / len(scenes))
        axes.set_title(title)
    handles: list[Patch | Line2D] = []
    if any(scene.truth for scene in scenes):
        handles.append(Patch(facecolor="#e3e5e8", edgecolor=figure.TRUTH, linewidth=0.6, label="truth"))
    if any(scene.way.points for scene in scenes):
        driven = all(scene.way.recorded for scene in scenes)
        handles.append(Line2D([], [], color=figure.PATH, linewidth=0.9, label="way" if driven else "planned way"))
    handles += [Patch(facecolor="none", edgecolor=colours[name], linewidth=1.2, label=name) for name in names]
    if handles:
        columns = max(3, int(width_mm // 22))
        drawn.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), columns), frameon=False)
    return drawn


def floor(axes: "Axes", occupancy: Occupancy | None) -> list[tuple[float, float]]:
    """Draw what stands on the floor; return its corners, none where it is not known."""
    if occupancy is None:
        return []
    from matplotlib.colors import ListedColormap

    (left, bottom), (right, top) = occupancy.low, occupancy.high
    axes.imshow(
        occupancy.occupied,
        cmap=ListedColormap(["#ffffff", figure.FLOOR]),
        vmin=0,
        vmax=1,
        extent=(left, right, bottom, top),
        interpolation="nearest",
        zorder=0,
    )
    return [occupancy.low, occupancy.high]


def _map(axes: "Axes", scene: SceneMaterial, colours: dict[str, str], width_mm: float) -> None:
    places = floor(axes, scene.occupancy)
    for _, box in scene.truth:
        places += _rectangle(axes, box, facecolor="#e3e5e8", edgecolor=figure.TRUTH, linewidth=0.6, zorder=2)
    if scene.way.points:
        xs, ys = zip(*scene.way.points, strict=True)
        axes.plot(xs, ys, color=figure.PATH, linewidth=0.9, zorder=3)
        axes.plot(xs[0], ys[0], "o", color="white", markeredgecolor=figure.PATH, markersize=4, zorder=4)
        axes.plot(xs[-1], ys[-1], "s", color=figure.PATH, markersize=3.2, zorder=4)
        places += scene.way.points
    for label, box in scene.proposed:
        places += _rectangle(axes, box, facecolor="none", edgecolor=colours[label], linewidth=1.2, zorder=5)
    figure.as_map(axes, places)
    shown = sorted(scene.proposed or scene.truth, key=lambda item: -item[1].extent[0] * item[1].extent[1])
    left, right = axes.get_xlim()
    for item in _apart(shown, (right - left) / width_mm * MM_PER_PT * LABEL_PT):
        _label(axes, item, colours if scene.proposed else {})


def _rectangle(axes: "Axes", box: Box, **look: object) -> list[tuple[float, float]]:
    from matplotlib.patches import Rectangle

    (x, y, _), (width, depth, _) = box.centroid, box.extent
    low = (x - width / 2, y - depth / 2)
    axes.add_patch(Rectangle(low, width, depth, **look))  # type: ignore[arg-type]
    return [low, (x + width / 2, y + depth / 2)]


def _apart(items: Sequence[Labelled], letter_m: float) -> list[Labelled]:
    """Return those whose labels do not cover one another, the earlier ones first; `letter_m` is a letter's height."""
    kept: list[Labelled] = []
    for item in items:
        clear = (
            abs(item[1].centroid[1] - other[1].centroid[1]) > 1.1 * letter_m
            or abs(item[1].centroid[0] - other[1].centroid[0]) > 0.32 * letter_m * (len(item[0]) + len(other[0]))
            for other in kept
        )
        if all(clear):
            kept.append(item)
    return kept


def _label(axes: "Axes", item: Labelled, colours: dict[str, str]) -> None:
    from matplotlib.patheffects import withStroke

    label, box = item
    x, y, _ = box.centroid
    axes.annotate(
        label,
        (x, y),
        ha="center",
        va="center",
        fontsize=LABEL_PT,
        color=colours.get(label, figure.FAINT),
        path_effects=[withStroke(linewidth=1.2, foreground="white")],
        zorder=6,
    )
