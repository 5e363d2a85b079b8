"""The trees of a panorama."""

import math
from dataclasses import dataclass

import numpy as np

from benchbot_sim_taichi.exterior.canvas import TEXEL, Array, Canvas, Light, columns_around, pulse, sample
from benchbot_sim_taichi.exterior.houses import PITCH_M, STREET_M

LEAVES = np.array([[0.07, 0.1, 0.04], [0.085, 0.105, 0.045], [0.055, 0.085, 0.045], [0.1, 0.105, 0.055]])


@dataclass(frozen=True)
class Tree:
    """A broad-leaved tree or a bush: a trunk, and leaves in balls."""

    x: float
    y: float
    height_m: float
    width_m: float
    leaves: Array
    seed: int

    @property
    def distance_m(self) -> float:
        """To its trunk."""
        return math.hypot(self.x, self.y)

    @property
    def top_m(self) -> float:
        """Of its crown."""
        return self.height_m

    @property
    def half_angle(self) -> float:
        """Half of what its crown takes."""
        return math.atan(0.6 * self.width_m / self.distance_m)

    def paint(self, canvas: Canvas, light: Light) -> None:
        """Leaves lit by sun and sky, their gaps, and the trunk."""
        at, distance = math.atan2(self.y, self.x), self.distance_m
        columns = columns_around(at, self.half_angle)
        rows = canvas.rows(-0.3, self.height_m * 1.05, distance, distance)
        turn = (canvas.azimuth[columns] - at + math.pi) % (2 * math.pi) - math.pi
        u = (np.tan(turn) * distance)[None, :]
        v = (canvas.eye_m + canvas.slope[rows, None] * distance) + 0.0 * u
        texel_m = TEXEL * distance
        random = np.random.default_rng(self.seed)
        ragged = sample(canvas.noise, u * 2.1 + self.seed, v * 2.1) - 0.5
        fine = sample(canvas.noise, u * 7.0, v * 7.0 + self.seed) - 0.5
        crown = 0.5 * self.width_m
        depth = np.full(v.shape, -1e9)
        normal = np.zeros((*v.shape, 3))
        right = np.array([-math.sin(at), math.cos(at), 0.0])
        toward = np.array([-math.cos(at), -math.sin(at), 0.0])
        cover = np.zeros(v.shape)
        for k in range(9):
            size = crown * random.uniform(0.42, 0.66) * (1.0 if k else 1.25)
            side = random.uniform(-1, 1) * (crown - 0.8 * size)
            up = self.height_m - size - abs(random.normal(0, 0.28)) * self.height_m * 0.75
            up = max(up, 0.32 * self.height_m)
            front = random.uniform(-0.5, 1.0) * crown
            du, dv = (u - side) / size, (v - up) / size
            rim = 1.0 + 0.55 * ragged + 0.35 * fine - np.sqrt(du**2 + dv**2)
            part = np.clip(rim * size / texel_m + 0.5, 0.0, 1.0)
            bulge = np.sqrt(np.clip(1.0 - du**2 - dv**2, 0.0, 1.0))
            here = front + bulge * size
            nearer = (part > 0.4) & (here > depth)
            depth = np.where(nearer, here, depth)
            ball = du[..., None] * right + dv[..., None] * np.array([0.0, 0.0, 1.0]) + bulge[..., None] * toward
            normal = np.where(nearer[..., None], ball, normal)
            cover = np.maximum(cover, part)
        length = np.sqrt((normal**2).sum(axis=-1, keepdims=True))
        normal = normal / np.maximum(length, 1e-6)
        shade = (0.55 + 0.45 * np.clip(v / self.height_m, 0, 1)) * (1.0 + 0.9 * fine + 0.5 * ragged)
        color = self.leaves * light.on(normal) * np.clip(shade, 0.15, 2.0)[..., None]
        trunk = pulse(u + 0.0 * v, 0.04 * self.height_m, texel_m) * (v > 0) * (v < 0.5 * self.height_m)
        bark = np.array([0.1, 0.08, 0.06]) * light.on(toward[None])
        color = np.where((cover > 0.05)[..., None], color, bark)
        cover = np.maximum(cover, trunk)
        canvas.blend(rows, columns, canvas.hazy(color, distance, columns), cover)


def scattered_trees(
    count: int, between_m: tuple[float, float], random: np.random.Generator, in_yards: bool
) -> list[Tree]:
    """Return trees all around, closer together the nearer they are; in a town along its streets and in the yard."""
    trees: list[Tree] = []
    for _ in range(count):
        angle = random.uniform(0, 2 * math.pi)
        distance = between_m[0] + (between_m[1] - between_m[0]) * random.random() ** 1.5
        x, y = distance * math.cos(angle), distance * math.sin(angle)
        height = random.uniform(6.0, 13.0)
        if in_yards:
            x = round(x / PITCH_M - 0.5) * PITCH_M + PITCH_M / 2 + random.choice([-1, 1]) * 0.36 * STREET_M
            height = random.uniform(5.0, 9.0)
        trees.append(
            Tree(
                x,
                y,
                float(height),
                float(height * random.uniform(0.6, 0.95)),
                LEAVES[random.integers(len(LEAVES))] * random.uniform(0.85, 1.2),
                int(random.integers(1 << 20)),
            )
        )
    return trees
