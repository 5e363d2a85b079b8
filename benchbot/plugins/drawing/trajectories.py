"""Ways from above: where the robot went, and where a solution believed that it went."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from benchbot.plugins.drawing import figure
from benchbot.plugins.drawing.maps import floor
from benchbot.plugins.drawing.material import SceneMaterial

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PANEL_MM = 80.0


def draw(scenes: Sequence[SceneMaterial], width_mm: float) -> "Figure":
    """Return the figure of ways, side by side; the estimate is fitted to the truth, moved and turned as a whole."""
    drawn, panels = figure.panels(len(scenes), width_mm, min(PANEL_MM, width_mm) + 8)
    handles = {}
    titles = figure.lettered([scene.title for scene in scenes])
    for axes, scene, title in zip(panels, scenes, titles, strict=True):
        places = [*floor(axes, scene.occupancy), *scene.way.points]
        if scene.way.points:
            xs, ys = zip(*scene.way.points, strict=True)
            name = "true way" if scene.way.recorded else "planned way"
            (handles[name],) = axes.plot(xs, ys, color=figure.PATH, linewidth=1.1, zorder=3, label=name)
            (start,) = axes.plot(
                xs[0], ys[0], "o", color="white", markeredgecolor=figure.INK, markersize=4, zorder=6, label="start"
            )
            (end,) = axes.plot(xs[-1], ys[-1], "s", color=figure.INK, markersize=3.2, zorder=6, label="end")
            handles |= {"start": start, "end": end}
        if scene.estimate is not None and len(scene.estimate):
            name = "estimate (fitted)"
            (handles[name],) = axes.plot(
                *scene.estimate.T, color=figure.ESTIMATE, linewidth=0.9, linestyle=(0, (4, 1.5)), zorder=4, label=name
            )
            places += [(float(x), float(y)) for x, y in np.asarray(scene.estimate)]
        figure.as_map(axes, places)
        axes.set_title(title)
    if handles:
        drawn.legend(handles=list(handles.values()), loc="outside lower center", ncols=5, frameon=False)
    return drawn
