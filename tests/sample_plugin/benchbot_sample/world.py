"""A flat world of round posts and straight walls: distances and rays in closed form."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class World:
    """`posts` (P, 3) are [x, y, radius], `walls` (W, 4) are [x0, y0, x1, y1]; `labels` name posts, then walls."""

    posts: Floats
    walls: Floats
    labels: tuple[str | None, ...]

    def clearance_m(self, points: Floats) -> Floats:
        """Return the distance (N,) from points (N, 2) to the nearest surface, negative inside a post."""
        to_posts = np.linalg.norm(points[:, None] - self.posts[:, :2], axis=2) - self.posts[:, 2]
        start, along = self.walls[:, :2], self.walls[:, 2:] - self.walls[:, :2]
        offset = points[:, None] - start
        fraction = np.clip(np.sum(offset * along, 2) / np.sum(along * along, 1), 0.0, 1.0)
        to_walls = np.linalg.norm(offset - fraction[..., None] * along, axis=2)
        nearest: Floats = np.concatenate([to_posts, to_walls], 1).min(1, initial=math.inf)
        return nearest

    def cast(self, x: float, y: float, angles_rad: Floats) -> tuple[Floats, NDArray[np.intp]]:
        """Return the distance (N,) along each ray, +inf for none, and the index (N,) into `labels` of what it hits."""
        direction = np.stack([np.cos(angles_rad), np.sin(angles_rad)], 1)
        distances = np.concatenate([self._to_posts(x, y, direction), self._to_walls(x, y, direction)], 1)
        nearest = np.argmin(distances, 1)
        return distances[np.arange(len(angles_rad)), nearest], nearest

    def _to_posts(self, x: float, y: float, direction: Floats) -> Floats:
        centre = self.posts[:, :2] - [x, y]
        along = direction @ centre.T
        discriminant = along**2 - (np.sum(centre**2, 1) - self.posts[:, 2] ** 2)
        distance = along - np.sqrt(np.maximum(discriminant, 0.0))
        return np.where((discriminant >= 0) & (distance >= 0), distance, np.inf)

    def _to_walls(self, x: float, y: float, direction: Floats) -> Floats:
        offset = self.walls[:, :2] - [x, y]
        along = self.walls[:, 2:] - self.walls[:, :2]
        across = direction[:, :1] * along[:, 1] - direction[:, 1:] * along[:, 0]
        safe = np.where(np.abs(across) < 1e-12, 1.0, across)
        distance = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / safe
        fraction = (offset[:, 0] * direction[:, 1:] - offset[:, 1] * direction[:, :1]) / safe
        hit = (np.abs(across) >= 1e-12) & (distance >= 0) & (fraction >= 0) & (fraction <= 1)
        return np.where(hit, distance, np.inf)


def read(path: Path) -> World:
    """Read a map: YAML with `posts` [{circle: [x, y, radius], label}] and `walls` [{segment: [x0, y0, x1, y1]}]."""
    document = schema.read(path)
    try:
        posts = [(entry["circle"], entry.get("label")) for entry in document["posts"]]
        walls = [(entry["segment"], entry.get("label")) for entry in document["walls"]]
        return World(
            np.array([shape for shape, _ in posts], dtype=np.float64).reshape(-1, 3),
            np.array([shape for shape, _ in walls], dtype=np.float64).reshape(-1, 4),
            tuple(label for _, label in (*posts, *walls)),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise BenchbotError(
            f"{path} is not a map of the sample world.",
            f"It must list 'posts' and 'walls' ({type(error).__name__}: {error}).",
            "Compare it with the maps of the sample plug-in.",
        ) from error
