"""Draws what a robot observes: one panel for each kind of observation, redrawn at every step."""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchbot.api.tools import panels
from benchbot.api.tools.surfaces import Surface, open_surface
from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

Draw = Callable[[Any, Any], None]

# Name of the panel -> the observation that it shows, and what draws it.
_PANELS: dict[str, tuple[str, Draw]] = {
    "image_rgb": ("image_rgb", panels.draw_rgb),
    "image_depth": ("image_depth", panels.draw_depth),
    "laser": ("laser", panels.draw_laser),
    "lidar": ("lidar", panels.draw_lidar),
    "poses": ("poses", panels.draw_poses),
    "image_class": ("image_segment", panels.draw_classes),
    "image_instance": ("image_segment", panels.draw_instances),
}

SUPPORTED_OBSERVATIONS = list(_PANELS)


class ObservationVisualiser:
    """Shows observations in a window where there is a display, below the cell in a notebook, else in a PNG file.

    The panels of `vis_list`, of `SUPPORTED_OBSERVATIONS`, fill a grid of two rows column by column; `image_class` and
    `image_instance` show `image_segment`. `image_path` is the PNG file, overwritten at every step.
    """

    def __init__(
        self,
        vis_list: Sequence[str] = ("image_rgb", "image_depth", "laser", "poses"),
        image_path: str | os.PathLike[str] = "observations.png",
    ) -> None:
        if isinstance(vis_list, str) or not vis_list:
            raise _mistake(
                "There is nothing to visualise.",
                f"vis_list is {vis_list!r}; it must be a list of names.",
                "Write for example: ObservationVisualiser(vis_list=['image_rgb', 'laser'])",
            )
        for name in vis_list:
            if name not in _PANELS:
                raise _mistake(
                    f"'{name}' cannot be visualised.",
                    f"There are: {', '.join(_PANELS)}.{did_you_mean(name, list(_PANELS))}",
                    "Mend the name in vis_list.",
                )
        self.vis_list = list(vis_list)
        self.fig: Figure | None = None
        self.axs: NDArray[Any] | None = None
        self._image_path = Path(image_path)
        self._surface: Surface | None = None

    def visualise(self, observations: Mapping[str, Any], step_count: int | None = None) -> None:
        """Draw what `reset` or `step` returned; raises BenchbotError when an observation of `vis_list` is not there."""
        for name in self.vis_list:
            if _PANELS[name][0] not in observations:
                raise _mistake(
                    f"'{name}' cannot be drawn: there is no observation '{_PANELS[name][0]}'.",
                    f"Observed: {', '.join(observations) or 'nothing'}.",
                    "Take it out of vis_list, or choose a task that observes it (benchbot list tasks).",
                )
        if self._surface is None:
            self._surface = open_surface(self._image_path)
            self.fig = self._surface.figure
            self.axs = _grid(self.fig, self.vis_list)
        if self.axs is None or not self._surface.is_open:
            return
        for axes, name in zip(self.axs.T.flat, self.vis_list, strict=False):
            axes.clear()
            source, draw = _PANELS[name]
            draw(axes, observations[source])
        self._surface.title("Agent Observations" + ("" if step_count is None else f" (step # {step_count})"))
        self.update()

    def update(self) -> None:
        """Bring what was drawn to the screen, without waiting for anybody."""
        if self._surface is not None and self._surface.is_open:
            self._surface.show()


def _grid(figure: "Figure", names: Sequence[str]) -> "NDArray[Any]":
    """Make a panel for each name: one alone, else two rows filled column by column; at most one place stays blank."""
    rows, columns = (1, 1) if len(names) == 1 else (2, (len(names) + 1) // 2)
    figure.set_size_inches(4.8 * columns, 3.6 * rows)
    axs = np.empty((rows, columns), dtype=object)
    for i, name in enumerate(names):
        column, row = divmod(i, rows)
        projection = "3d" if name == "poses" else None
        axs[row, column] = figure.add_subplot(rows, columns, row * columns + column + 1, projection=projection)
    return axs


def _mistake(title: str, why: str, fix: str) -> BenchbotError:
    return BenchbotError(title, why, fix, failure=FailureClass.AGENT)
