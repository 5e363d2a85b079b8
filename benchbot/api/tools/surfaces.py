"""Where pictures appear: a window, a notebook or a file. Which it is turns out at the first figure, never at import."""

import os
import tempfile
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WINDOW_PAUSE_S = 0.05
DOTS_PER_INCH = 100


class Surface(Protocol):
    """A figure, and a way to show it."""

    figure: "Figure"

    @property
    def is_open(self) -> bool:
        """Whether somebody may still be looking."""

    def title(self, text: str) -> None:
        """Say what is shown."""

    def show(self) -> None:
        """Bring the figure to whoever looks."""


def open_surface(image_path: Path) -> Surface:
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
        return NotebookCell()
    if backend in {"agg", "cairo", "pdf", "pgf", "ps", "svg", "template"}:
        return ImageFile(image_path)
    return Window()


class Window:
    """A window of its own; one that was closed stays closed."""

    def __init__(self) -> None:
        from matplotlib import pyplot as plt

        self._pyplot = plt
        plt.ion()
        self.figure = plt.figure(layout="constrained")

    @property
    def is_open(self) -> bool:
        """Whether the window has not been closed."""
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


class NotebookCell:
    """The output of the running notebook cell: the picture takes the place of the one before in the same cell."""

    is_open = True

    def __init__(self) -> None:
        self.figure = _unmanaged_figure()
        self._cell: int | None = None
        self._handle: Any = None

    def title(self, text: str) -> None:
        """Write the title above the panels."""
        self.figure.suptitle(text)

    def show(self) -> None:
        """Put the picture below the cell."""
        from IPython import get_ipython
        from IPython.display import Image, display

        picture = Image(data=_png(self.figure))  # type: ignore[no-untyped-call]
        cell = get_ipython().execution_count
        if self._handle is not None and cell == self._cell:
            self._handle.update(picture)
        else:
            self._cell = cell
            self._handle = display(picture, display_id=True)  # type: ignore[no-untyped-call]


class ImageFile:
    """A PNG file, overwritten by each picture."""

    is_open = True

    def __init__(self, path: Path) -> None:
        self.figure = _unmanaged_figure()
        self._path = path.absolute()
        self._announced = False

    def title(self, text: str) -> None:
        """Write the title above the panels."""
        self.figure.suptitle(text)

    def show(self) -> None:
        """Write the file, so that who reads it never sees half of it."""
        try:
            handle, temporary = tempfile.mkstemp(dir=self._path.parent, prefix=f".{self._path.name}.")
            with os.fdopen(handle, "wb") as file:
                file.write(_png(self.figure))
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


def _unmanaged_figure() -> "Figure":
    """Return a figure that pyplot knows nothing of, so that nobody else shows or closes it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained", dpi=DOTS_PER_INCH)
    FigureCanvasAgg(figure)
    return figure


def _png(figure: "Figure") -> bytes:
    buffer = BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()
