"""Boards of 44 triangles, for models of which there are many: one chamfer a side, shaded as if it were round."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product

import numpy as np

from tools.household.model import Floats, Mesh


def board(low: Sequence[float], high: Sequence[float], bevel: float = 0.003, grain: str = "") -> Mesh:
    """A box between two corners, with the grain along its longest side unless told otherwise."""
    first, last = np.asarray(low, float), np.asarray(high, float)
    size = last - first
    half, middle = size / 2, (first + last) / 2
    along = "xyz".index(grain) if grain else int(np.argmax(size))
    bevel = min(bevel, float(half.min()) * 0.999)
    box = _Box(half, bevel, along)
    for axis, side in product(range(3), (1.0, -1.0)):
        second, third = (axis + 1) % 3, (axis + 2) % 3
        loop = [box.corner(axis, {axis: side, second: a, third: b}) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        box.add(loop, [axis] * 4, axis)
    for first_axis, second_axis in combinations(range(3), 2):
        third = 3 - first_axis - second_axis
        for a, b in product((1.0, -1.0), repeat=2):
            points = [
                (face, {first_axis: a, second_axis: b, third: end})
                for face, end in ((first_axis, -1.0), (first_axis, 1.0), (second_axis, 1.0), (second_axis, -1.0))
            ]
            box.add([box.corner(face, signs) for face, signs in points], [face for face, _ in points], first_axis)
    for signs in product((1.0, -1.0), repeat=3):
        box.add([box.corner(face, dict(enumerate(signs))) for face in range(3)], [0, 1, 2], None)
    return box.mesh(middle)


class _Box:
    """Polygons about the origin, as they are added."""

    def __init__(self, half: Floats, bevel: float, along: int) -> None:
        self.half, self.bevel, self.along = half, bevel, along
        self.points: list[Floats] = []
        self.normals: list[Floats] = []
        self.uvs: list[tuple[float, float]] = []
        self.triangles: list[tuple[int, int, int]] = []

    def corner(self, face: int, signs: dict[int, float]) -> Floats:
        """The corner of the face across axis `face` that lies towards the signs."""
        reach = self.half - self.bevel
        return np.array([signs[axis] * (self.half[axis] if axis == face else reach[axis]) for axis in range(3)])

    def add(self, loop: list[Floats], faces: list[int], projected: int | None) -> None:
        """A triangle or quad; `faces` give the normals, `projected` the texture's plane (None: each its own)."""
        start = len(self.points)
        outwards = np.cross(loop[1] - loop[0], loop[2] - loop[0]) @ np.mean(loop, axis=0)
        for point, face in zip(loop, faces, strict=True):
            axis = face if projected is None else projected
            u_axis = self.along if axis != self.along else (axis + 1) % 3
            self.points.append(point)
            self.normals.append(np.eye(3)[face] * np.sign(point[face]))
            self.uvs.append((float(point[u_axis]), float(point[3 - axis - u_axis])))
        order = range(len(loop)) if outwards > 0 else range(len(loop) - 1, -1, -1)
        ring = [start + index for index in order]
        self.triangles += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]

    def mesh(self, middle: Floats) -> Mesh:
        """All of it, moved to `middle`."""

        return Mesh(
            np.array(self.points) + middle,
            np.array(self.triangles, np.int32),
            np.array(self.normals),
            np.array(self.uvs) + middle[:2],
        )
