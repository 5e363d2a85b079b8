"""Drawing observations: one panel for each kind, redrawn at every step. `semantic_map` draws maps of objects.

Importing this costs nothing: matplotlib is first imported when something is drawn, and chooses its own backend then.
"""

import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchbot.api.tools import panels
from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean

__all__ = ["SUPPORTED_OBSERVATIONS", "ObservationVisualiser"]

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

Draw = Callable[[Any, Any], None]

# Name of the panel -> the observation that it shows, and the function that draws it.
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
WINDOW_PAUSE_S = 0.05
DOTS_PER_INCH = 100


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
        self._display: _Display | None = None

    def visualise(self, observations: Mapping[str, Any], step_count: int | None = None) -> None:
        """Draw the observations of a step; raises BenchbotError when one of `vis_list` is missing."""
        for name in self.vis_list:
            if _PANELS[name][0] not in observations:
                raise _mistake(
                    f"'{name}' cannot be drawn: there is no observation '{_PANELS[name][0]}'.",
                    f"Observed: {', '.join(observations) or 'nothing'}.",
                    "Take it out of vis_list, or choose a task that observes it (benchbot list tasks).",
                )
        if self._display is None:
            self._display = _open_display(self._image_path)
            self.fig = self._display.figure
            self.axs = _grid(self.fig, self.vis_list)
        if self.axs is None or not self._display.is_open:
            return
        for axes, name in zip(self.axs.T.flat, self.vis_list, strict=False):
            axes.clear()
            source, draw = _PANELS[name]
            draw(axes, observations[source])
        self._display.title("Agent Observations" + ("" if step_count is None else f" (step # {step_count})"))
        self.update()

    def update(self) -> None:
        """Show the drawing, without waiting for input."""
        if self._display is not None and self._display.is_open:
            self._display.show()


def _open_display(image_path: Path) -> "_Display":
    """Open a window if matplotlib finds a display or MPLBACKEND names one; else a place in the notebook, or a file."""
    try:
        import matplotlib as mpl
    except ImportError as error:
        raise BenchbotError(
            "Observations cannot be drawn.",
            f"matplotlib cannot be imported: {error}.",
            "Install it: pip install 'benchbot[viz]'",
        ) from error
    # Asked for its backend, matplotlib chooses one: it looks for a display, and falls back to Agg, which draws files.
    backend = mpl.get_backend().lower()
    if "inline" in backend:
        return _NotebookCell()
    if backend in {"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"}:
        return _ImageFile(image_path)
    return _Window()


class _Display:
    """A figure that pyplot does not manage, so that nothing else shows or closes it."""

    def __init__(self) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.figure = Figure(layout="constrained", dpi=DOTS_PER_INCH)
        FigureCanvasAgg(self.figure)

    @property
    def is_open(self) -> bool:
        """Whether the figure can still be seen."""
        return True

    def title(self, text: str) -> None:
        """Write the title above the panels."""
        self.figure.suptitle(text)

    def show(self) -> None:
        """Show the figure as it is now."""
        raise NotImplementedError

    def png(self) -> bytes:
        """Return the figure as a PNG file."""
        buffer = BytesIO()
        self.figure.savefig(buffer, format="png")
        return buffer.getvalue()


class _Window(_Display):
    """A window of its own; one that was closed stays closed."""

    def __init__(self) -> None:
        from matplotlib import pyplot as plt

        self._pyplot = plt
        plt.ion()
        self.figure = plt.figure(layout="constrained")

    @property
    def is_open(self) -> bool:
        return bool(self._pyplot.fignum_exists(self.figure.number))

    def title(self, text: str) -> None:
        """Set the title of the window."""
        manager = self.figure.canvas.manager
        if manager is not None:
            manager.set_window_title(text)

    def show(self) -> None:
        """Redraw, and let the window handle what was clicked meanwhile."""
        self.figure.canvas.draw_idle()
        self.figure.canvas.start_event_loop(WINDOW_PAUSE_S)


class _NotebookCell(_Display):
    """The output of the running notebook cell: the picture takes the place of the one before in the same cell."""

    def __init__(self) -> None:
        super().__init__()
        self._cell: int | None = None
        self._handle: Any = None

    def show(self) -> None:
        from IPython import get_ipython
        from IPython.display import Image, display

        picture = Image(data=self.png())  # type: ignore[no-untyped-call]
        cell = get_ipython().execution_count
        if self._handle is not None and cell == self._cell:
            self._handle.update(picture)
        else:
            self._cell = cell
            self._handle = display(picture, display_id=True)  # type: ignore[no-untyped-call]


class _ImageFile(_Display):
    """A PNG file, overwritten by each picture."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path.absolute()
        self._announced = False

    def show(self) -> None:
        try:
            # Renamed into place, so that a reader never sees half of it.
            handle, temporary = tempfile.mkstemp(dir=self._path.parent, prefix=f".{self._path.name}.")
            with os.fdopen(handle, "wb") as file:
                file.write(self.png())
            Path(temporary).replace(self._path)
        except OSError as error:
            raise BenchbotError(
                f"The picture {self._path} cannot be written.",
                f"{error.strerror or error}.",
                "Choose another place: ObservationVisualiser(image_path=…)",
            ) from error
        if not self._announced:
            print(f"There is no display: the observations are drawn in {self._path}", flush=True)
            self._announced = True


def _grid(figure: "Figure", names: Sequence[str]) -> "NDArray[Any]":
    """Make a panel for each name: one alone, else two rows filled column by column; at most one place stays blank."""
    rows, columns = (1, 1) if len(names) == 1 else (2, (len(names) + 1) // 2)
    figure.set_size_inches(480 * columns / DOTS_PER_INCH, 360 * rows / DOTS_PER_INCH)
    axs = np.empty((rows, columns), dtype=object)
    for i, name in enumerate(names):
        column, row = divmod(i, rows)
        projection = "3d" if name == "poses" else None
        axs[row, column] = figure.add_subplot(rows, columns, row * columns + column + 1, projection=projection)
    return axs


def _mistake(title: str, why: str, fix: str) -> BenchbotError:
    return BenchbotError(title, why, fix, failure=FailureClass.AGENT)
