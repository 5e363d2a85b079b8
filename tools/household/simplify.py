"""Fewer triangles for the same form: edges collapse where that moves the surface least.

After M. Garland and P. Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 1997.
"""

from __future__ import annotations

import heapq

import numpy as np

from tools.household.model import Floats, Ints

# A little of the way to the middle of an edge counts, too: on a plane each place would be as good.
_TO_MIDDLE = 1e-3


def simplified(vertices: Floats, triangles: Ints, count: int) -> tuple[Floats, Ints]:
    """A closed surface of shared `vertices` (N, 3) with at most `count` triangles, or as few as its form allows."""
    surface = _Surface(vertices, triangles)
    while surface.left > count and surface.edges:
        surface.collapse_next()
    kept = np.array([face for face in surface.faces if face is not None])
    used, inverse = np.unique(kept, return_inverse=True)
    return surface.points[used], inverse.reshape(-1, 3).astype(np.int32)


class _Surface:
    """A surface that shrinks; `faces` has None for those that are gone."""

    def __init__(self, vertices: Floats, triangles: Ints) -> None:
        self.points = np.array(vertices, float)
        self.faces: list[tuple[int, int, int] | None] = [(int(a), int(b), int(c)) for a, b, c in triangles]
        self.left = len(self.faces)
        self.of_vertex: list[set[int]] = [set() for _ in self.points]
        self.quadrics = np.zeros((len(self.points), 4, 4))
        self.changes = [0] * len(self.points)
        for number, face in enumerate(triangles):
            plane = self._plane(self.points[face])
            for vertex in face:
                self.of_vertex[vertex].add(number)
                self.quadrics[vertex] += plane
        self.edges: list[tuple[float, int, int, int, tuple[float, ...]]] = []
        for first, last in sorted({tuple(sorted((face[i], face[i - 1]))) for face in triangles for i in range(3)}):
            self._push(int(first), int(last))

    def collapse_next(self) -> None:
        """Take the edge that costs least, and make it a point unless the surface would fold there."""
        _, first, last, changes, place = heapq.heappop(self.edges)
        if changes != self.changes[first] + self.changes[last] or not self.of_vertex[last] or not self.of_vertex[first]:
            return
        shared = self.of_vertex[first] & self.of_vertex[last]
        around = self._neighbours(first) & self._neighbours(last)
        moved = (self.of_vertex[first] | self.of_vertex[last]) - shared
        if len(shared) != 2 or len(around) != 2 or any(self._flips(face, first, last, place) for face in moved):
            return
        for number in shared:
            for vertex in self.faces[number] or ():
                self.of_vertex[vertex].discard(number)
            self.faces[number] = None
        for number in self.of_vertex[last]:
            a, b, c = (first if vertex == last else vertex for vertex in self.faces[number] or ())
            self.faces[number] = (a, b, c)
        self.of_vertex[first] |= self.of_vertex[last]
        self.of_vertex[last] = set()
        self.points[first] = place
        self.quadrics[first] += self.quadrics[last]
        self.left -= 2
        self.changes[first] += 1
        for vertex in sorted(self._neighbours(first)):
            self._push(first, vertex)

    def _push(self, first: int, last: int) -> None:
        quadric = self.quadrics[first] + self.quadrics[last]
        middle = (self.points[first] + self.points[last]) / 2
        weight = _TO_MIDDLE * float(np.trace(quadric[:3, :3])) + 1e-15
        place = np.linalg.solve(quadric[:3, :3] + weight * np.eye(3), weight * middle - quadric[:3, 3])
        cost = float(place @ quadric[:3, :3] @ place + 2.0 * quadric[:3, 3] @ place + quadric[3, 3])
        changes = self.changes[first] + self.changes[last]
        heapq.heappush(self.edges, (cost, first, last, changes, tuple(place)))

    def _neighbours(self, vertex: int) -> set[int]:
        return {other for face in self.of_vertex[vertex] for other in self.faces[face] or ()} - {vertex}

    def _flips(self, number: int, first: int, last: int, place: tuple[float, ...]) -> bool:
        """Whether a triangle would turn by more than some 70 degrees, or lose its area."""
        face = self.faces[number] or ()
        before = self.points[list(face)]
        after = np.array([place if vertex in (first, last) else self.points[vertex] for vertex in face])
        one, other = (np.cross(corners[1] - corners[0], corners[2] - corners[0]) for corners in (before, after))
        return bool(one @ other < 0.35 * np.linalg.norm(one) * np.linalg.norm(other) + 1e-18)

    @staticmethod
    def _plane(corners: Floats) -> Floats:
        """The quadric of a triangle's plane, weighted by its area."""
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        area = float(np.linalg.norm(normal))
        if area < 1e-15:
            return np.zeros((4, 4))
        plane = np.append(normal / area, -(normal / area) @ corners[0])
        return np.asarray(np.outer(plane, plane) * area)
