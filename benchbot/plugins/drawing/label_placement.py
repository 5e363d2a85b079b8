"""Where the labels of a map go: near what they name, on top of nothing that matters."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

_DISTANCES_PX = (5, 12, 22, 36, 54, 78, 110)
_DIRECTIONS = 24


@dataclass(frozen=True)
class Rectangle:
    """An axis-aligned rectangle in pixels, y down."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def center(self) -> tuple[float, float]:
        """The middle."""
        return ((self.left + self.right) / 2, (self.top + self.bottom) / 2)

    @property
    def area(self) -> float:
        """In square pixels."""
        return (self.right - self.left) * (self.bottom - self.top)

    def overlap(self, other: "Rectangle") -> float:
        """Return the area shared with another one."""
        width = min(self.right, other.right) - max(self.left, other.left)
        height = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(width, 0.0) * max(height, 0.0)

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the rectangle that is nearest to a point."""
        return (min(max(x, self.left), self.right), min(max(y, self.top), self.bottom))


def place(
    boxes: Sequence[Rectangle],
    sizes: Sequence[tuple[float, float]],
    path: Sequence[tuple[float, float]],
    within: Rectangle,
    scale: float = 1.0,
) -> list[Rectangle]:
    """Return where the label of each box goes, given the labels' sizes.

    Labels of small boxes choose first. Each takes the place that hides least of other labels, of the boxes and of the
    path, and is nearest to its box; `scale` stretches the distances that are tried.
    """
    import numpy as np

    corners = np.array([_corners(box) for box in boxes], float).reshape(-1, 4)
    areas = np.array([box.area for box in boxes], float)
    points = np.array(path, float).reshape(-1, 2)
    paper = np.array([_corners(within)], float)
    placed = np.empty((0, 4))
    labels: dict[int, Rectangle] = {}
    for i in sorted(range(len(boxes)), key=lambda index: boxes[index].area):
        found = list(_candidates(boxes[i], sizes[i], scale))
        places = np.array([corner for corner, _ in found])
        distances_px = np.array([distance_px for _, distance_px in found])
        area = (places[:, 2:] - places[:, :2]).prod(1)
        # A label may well cover what its own box stands on; covering what is small is worst.
        is_under = _overlaps(corners[i : i + 1], corners)[0] > 0.8 * areas[i]
        badness = np.where(is_under, 0.15, 1.0 + 4.0 * (areas < 2 * sizes[i][0] * sizes[i][1]))
        badness[i] = 0.0
        hidden = 40 * _overlaps(places, placed).sum(1) + _overlaps(places, corners) @ badness
        left, top, right, bottom = places.T[:, :, None]
        x, y = points.T
        on_path = ((left < x) & (x < right) & (top < y) & (y < bottom)).sum(1)
        outside = area - _overlaps(places, paper)[:, 0]
        cost = (hidden + 100 * outside) / area + 0.15 * on_path + 0.012 * distances_px / scale
        best = places[int(cost.argmin())]
        placed = np.vstack([placed, best])
        labels[i] = Rectangle(*map(float, best))
    return [labels[i] for i in range(len(boxes))]


def legible(labels: Sequence[Rectangle], tolerance: float = 0.08) -> list[bool]:
    """Say which labels can be kept so that none hides another by more than a share of itself; the first go first."""
    kept: list[Rectangle] = []
    found = []
    for label in labels:
        fits = all(label.overlap(other) <= tolerance * min(label.area, other.area) for other in kept)
        found.append(fits)
        if fits:
            kept.append(label)
    return found


def _corners(rectangle: Rectangle) -> tuple[float, float, float, float]:
    return (rectangle.left, rectangle.top, rectangle.right, rectangle.bottom)


def _overlaps(some: "NDArray[Any]", others: "NDArray[Any]") -> "NDArray[Any]":
    """Return the areas (N, M) that rectangles (N, 4) share with others (M, 4)."""
    import numpy as np

    low = np.maximum(some[:, None, :2], others[None, :, :2])
    high = np.minimum(some[:, None, 2:], others[None, :, 2:])
    shared: NDArray[Any] = np.clip(high - low, 0.0, None).prod(2)
    return shared


def _candidates(
    box: Rectangle, size: tuple[float, float], scale: float
) -> Iterator[tuple[tuple[float, float, float, float], float]]:
    """Yield places for a label of `size`, and their distance from the box: inside when it fits, then all around."""
    width, height = size
    margin = 5 * scale
    if width + 2 * margin < box.right - box.left and height + 2 * margin < box.bottom - box.top:
        x, y = box.center
        columns = (x - width / 2, box.left + margin, box.right - margin - width)
        rows = (y - height / 2, box.top + margin, box.bottom - margin - height)
        for left in columns:
            for top in rows:
                yield (left, top, left + width, top + height), 0.0
    for distance_px in _DISTANCES_PX:
        for step in range(_DIRECTIONS):
            angle = 2 * math.pi * step / _DIRECTIONS
            dx, dy = math.cos(angle), math.sin(angle)
            # The label's centre runs along the box, widened by half the label and the distance.
            reach_x = (box.right - box.left + width) / 2 + distance_px * scale
            reach_y = (box.bottom - box.top + height) / 2 + distance_px * scale
            stretch = 1 / max(abs(dx) / reach_x, abs(dy) / reach_y)
            x, y = box.center[0] + dx * stretch, box.center[1] + dy * stretch
            yield (x - width / 2, y - height / 2, x + width / 2, y + height / 2), distance_px * scale
