"""Shortest paths of a disc across a floor plan.

Dijkstra on a graph in which each node is joined to those up to five nodes away in 80 directions, then pulled taut.
Before that a straight line is at most 0.5 % too long (1 / cos of half the largest angle between two directions).
"""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from benchbot_task_navigation.floor_plan import Floats, FloorPlan, Mask, Point

Follower = Callable[[Point], Floats | None]

REACH = 5
_NOWHERE = -9999  # what scipy says where there is no predecessor


class Ways:
    """The ways of a disc's centre in a plan: where its clearance is at least `radius_m`.

    `reach` is how many nodes away neighbours may be: 5 for measuring, 1 for planning fast.
    """

    def __init__(self, plan: FloorPlan, radius_m: float, reach: int = REACH) -> None:
        self.plan = plan
        self.radius_m = radius_m
        self.free: Mask = plan.clearance_m >= radius_m
        self._reach = reach

    def between(self, start: Point, goal: Point) -> Floats | None:
        """Return the shortest way as corners (N, 2), `start` and `goal` included, or None when there is none.

        Of a start or goal that is not free, the way leads from or to the nearest free place.
        """
        if self.sees(start, goal):
            return np.array([start, goal])
        way = self._follower(self._nearest(goal)[:1])(start)
        return None if way is None else self._taut(np.vstack([way, goal]))

    def towards(self, goals: Mask) -> Follower:
        """Return what gives the shortest way from a start to any node that is a goal and free, or None for none."""
        follow = self._follower(np.flatnonzero(goals[self.free]))

        def way(start: Point) -> Floats | None:
            found = follow(start)
            return None if found is None else self._taut(found)

        return way

    def distances_m(self, goal: Point) -> Floats:
        """Return how long the way from each node to a place is; from a node that is not free, of the nearest free."""
        found = np.full(self.free.shape, np.inf)
        if len(near := self._nearest(goal)):
            away_m = csgraph.dijkstra(self._graph, directed=False, indices=near[0])
            found[self.free] = away_m + math.dist(self._places[near[0]], goal)
        onto = ndimage.distance_transform_edt(~np.isfinite(found), return_distances=False, return_indices=True)
        filled: Floats = found[tuple(onto)]
        return filled

    def reachable(self, start: Point) -> Mask:
        """Return the nodes that can be reached from a place."""
        found = np.zeros_like(self.free)
        _, labels = csgraph.connected_components(self._graph, directed=False)
        if len(labels):
            found[self.free] = labels == labels[self._nearest(start)[0]]
        return found

    def sees(self, start: Point, goal: Point) -> bool:
        """Return whether the straight line between two places is free."""
        steps = max(2, math.ceil(2 * math.dist(start, goal) / self.plan.resolution_m))
        line = np.linspace(start, goal, steps + 1)
        return bool((self.plan.clearance_at(line) >= self.radius_m).all())

    def _follower(self, goals: NDArray[np.intp]) -> Follower:
        """Return what gives the way from a start along nodes to the nearest of some nodes, by number."""
        if not len(goals):
            return lambda _start: None
        length_m, onwards, _ = csgraph.dijkstra(
            self._graph, directed=False, indices=goals, min_only=True, return_predecessors=True
        )

        def way(start: Point) -> Floats | None:
            near = self._nearest(start)
            away_m = np.linalg.norm(self._places[near] - start, axis=1)
            node = int(near[np.argmin(length_m[near] + away_m)])
            if not math.isfinite(length_m[node]):
                return None
            corners = [np.asarray(start, np.float64)]
            while node != _NOWHERE:
                corners.append(self._places[node])
                node = int(onwards[node])
            return np.array(corners)

        return way

    def _taut(self, way: Floats) -> Floats:
        """Return the way without corners that can be cut."""
        corners, here = [0], 0
        while here < len(way) - 1:
            here = next(i for i in range(len(way) - 1, here, -1) if i == here + 1 or self._sees(way[here], way[i]))
            corners.append(here)
        return way[corners]

    def _sees(self, start: Floats, goal: Floats) -> bool:
        return self.sees((float(start[0]), float(start[1])), (float(goal[0]), float(goal[1])))

    def _nearest(self, point: Point) -> NDArray[np.intp]:
        """Return the free nodes that are so near that nothing is between, the nearest first; else the nearest."""
        if not len(self._nodes):
            return np.empty(0, np.intp)
        away_m = np.linalg.norm(self._places - point, axis=1)
        # Beyond an obstacle a free node is at least its radius away.
        near = np.flatnonzero(away_m <= min(self.radius_m, self._reach * self.plan.resolution_m))
        return near[np.argsort(away_m[near], kind="stable")] if len(near) else np.array([np.argmin(away_m)])

    @cached_property
    def _nodes(self) -> NDArray[np.intp]:
        return np.argwhere(self.free)

    @cached_property
    def _places(self) -> Floats:
        return self.plan.points(self._nodes)

    @cached_property
    def _graph(self) -> sparse.csr_array:
        numbers = np.full(self.free.shape, -1)
        numbers[self.free] = np.arange(len(self._nodes))
        starts, ends, lengths = [], [], []
        for i, j in _directions(self._reach):
            there = self._nodes + np.array([i, j])
            inside = ((there >= 0) & (there < self.free.shape)).all(1)
            here, there = self._nodes[inside], there[inside]
            clear = self.free[there[:, 0], there[:, 1]]
            here, there = here[clear], there[clear]
            between = max(abs(i), abs(j))
            clear = np.ones(len(here), bool)
            for k in range(1, between):
                middle = self.plan.points(here) + self.plan.resolution_m * np.array([i, j]) * (k / between)
                clear &= self.plan.clearance_at(middle) >= self.radius_m
            here, there = here[clear], there[clear]
            starts.append(numbers[here[:, 0], here[:, 1]])
            ends.append(numbers[there[:, 0], there[:, 1]])
            lengths.append(np.full(len(here), self.plan.resolution_m * math.hypot(i, j)))
        size = len(self._nodes)
        edges = (np.concatenate(lengths), (np.concatenate(starts), np.concatenate(ends)))
        return sparse.csr_array(edges, shape=(size, size))


def length_m(way: Floats) -> float:
    """Return the length of a way (N, 2)."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def _directions(reach: int) -> list[tuple[int, int]]:
    """Return one of each pair of opposite directions to nodes up to `reach` away, none a multiple of another."""
    offsets = [(i, j) for i in range(reach + 1) for j in range(-reach, reach + 1)]
    return [(i, j) for i, j in offsets if math.gcd(i, j) == 1 and (i, j) > (0, 0)]
