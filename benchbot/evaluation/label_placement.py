"""Where the labels of a map go: near what they name, on top of nothing that matters."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

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
    placed: dict[int, Rectangle] = {}
    for i in sorted(range(len(boxes)), key=lambda index: boxes[index].area):

        def cost(candidate: tuple[Rectangle, float], index: int = i) -> float:
            label, distance_px = candidate
            hidden = 40 * sum(label.overlap(other) for other in placed.values())
            hidden += sum(_hides(label, boxes[index], other) for j, other in enumerate(boxes) if j != index)
            points = sum(label.left < x < label.right and label.top < y < label.bottom for x, y in path)
            outside = label.area - label.overlap(within)
            return (hidden + 100 * outside) / label.area + 0.15 * points + 0.012 * distance_px / scale

        placed[i], _ = min(_candidates(boxes[i], sizes[i], scale), key=cost)
    return [placed[i] for i in range(len(boxes))]


def _hides(label: Rectangle, own: Rectangle, other: Rectangle) -> float:
    """Return how bad it is that `label` covers `other`: little if its own box stands on that, much if that is small."""
    shared = label.overlap(other)
    if not shared:
        return 0.0
    contains = own.overlap(other) > 0.8 * own.area
    return shared * (0.15 if contains else 1.0 + 4.0 * (other.area < 2 * label.area))


def _candidates(box: Rectangle, size: tuple[float, float], scale: float) -> Iterator[tuple[Rectangle, float]]:
    """Yield places for a label of `size`, and their distance from the box: inside when it fits, then all around."""
    width, height = size
    margin = 5 * scale
    if width + 2 * margin < box.right - box.left and height + 2 * margin < box.bottom - box.top:
        x, y = box.center
        columns = (x - width / 2, box.left + margin, box.right - margin - width)
        rows = (y - height / 2, box.top + margin, box.bottom - margin - height)
        for left in columns:
            for top in rows:
                yield Rectangle(left, top, left + width, top + height), 0.0
    for distance_px in _DISTANCES_PX:
        for step in range(_DIRECTIONS):
            angle = 2 * math.pi * step / _DIRECTIONS
            dx, dy = math.cos(angle), math.sin(angle)
            # The label's centre runs along the box, widened by half the label and the distance.
            reach_x = (box.right - box.left + width) / 2 + distance_px * scale
            reach_y = (box.bottom - box.top + height) / 2 + distance_px * scale
            stretch = 1 / max(abs(dx) / reach_x, abs(dy) / reach_y)
            x, y = box.center[0] + dx * stretch, box.center[1] + dy * stretch
            yield Rectangle(x - width / 2, y - height / 2, x + width / 2, y + height / 2), distance_px * scale
