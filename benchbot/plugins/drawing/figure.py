"""What all figures share: sizes, fonts, the scale bar, and how they are written."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing.map_drawing import CLASS_COLORS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = (".png", ".svg", ".pdf")
MM_PER_INCH = 25.4
DPI = 300
FONT_PT, SMALL_PT = 7.0, 6.0
INK, FAINT, FLOOR = "#26292f", "#80868e", "#c9ccd1"
TRUTH, ESTIMATE, PATH = "#9aa0a8", "#d1495b", "#164278"
COLOURS = tuple("#{:02x}{:02x}{:02x}".format(*colour) for colour in CLASS_COLORS)
"""Of classes; in print without colours, their labels tell them apart."""

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


def panels(count: int, width_mm: float, height_mm: float, columns: int | None = None) -> "tuple[Figure, list[Axes]]":
    """Return a figure of so many panels, and them, in order; `height_mm` is that of one row."""
    from matplotlib.figure import Figure

    across = min(count, columns or count)
    rows = -(-count // across)
    figure = Figure(figsize=(width_mm / MM_PER_INCH, rows * height_mm / MM_PER_INCH), layout="constrained")
    drawn = [figure.add_subplot(rows, across, number + 1) for number in range(count)]
    return figure, drawn


def lettered(titles: Sequence[str]) -> list[str]:
    """Return the titles of panels, with a letter each where there are several, for a caption to speak of."""
    return list(titles) if len(titles) < 2 else [f"({chr(97 + n % 26)}) {title}" for n, title in enumerate(titles)]


def as_map(axes: "Axes", points: Sequence[tuple[float, float]]) -> None:
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


def _scale_bar(axes: "Axes") -> None:
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    length = scale_length_m(right - left)
    x, y = left + 0.02 * (right - left), bottom + 0.035 * (top - bottom)
    axes.plot([x, x + length], [y, y], color=INK, linewidth=1.6, solid_capstyle="butt", clip_on=False)
    words = f"{length:g} m" if length >= 1 else f"{100 * length:g} cm"
    axes.text(x + length / 2, y + 0.008 * (top - bottom), words, ha="center", va="bottom", fontsize=SMALL_PT, color=INK)
