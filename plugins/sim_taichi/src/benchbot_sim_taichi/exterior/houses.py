"""The houses of a panorama: boxes with windows in perspective, and the streets between them."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi.colorimetry import planckian
from benchbot_sim_taichi.exterior.canvas import (
    COLUMNS,
    TEXEL,
    Array,
    Canvas,
    Light,
    columns_around,
    hashed,
    pulse,
    sample,
    softened,
)

STOREY_M = 3.1
PITCH_M = 52.0  # of a town's streets
STREET_M = 15.0
FAR_BLOCKS = 7
LIT_SHARE = 0.32
LIT_WINDOW = 3e-3 * planckian(2700.0)  # 30 cd/m2 through a curtain
WALLS = np.array([[0.58, 0.53, 0.45], [0.47, 0.29, 0.22], [0.66, 0.64, 0.6], [0.5, 0.46, 0.41], [0.4, 0.41, 0.43]])
ROOFS = np.array([[0.3, 0.14, 0.1], [0.16, 0.15, 0.15], [0.22, 0.17, 0.14]])


@dataclass(frozen=True)
class House:
    """A box on the ground: its middle, its half sides, how it is turned; a hipped roof where `roof` is a slope."""

    x: float
    y: float
    half: tuple[float, float]
    turn: float
    height_m: float
    roof: float
    wall: Array
    tiles: Array
    window_m: float
    seed: int

    @property
    def distance_m(self) -> float:
        """To its middle."""
        return math.hypot(self.x, self.y)

    @property
    def top_m(self) -> float:
        """Of its ridge."""
        return self.height_m + self.roof * min(self.half)

    @property
    def half_angle(self) -> float:
        """Of the cone around its middle in which it lies."""
        return math.asin(min(math.hypot(*self.half) / self.distance_m, 0.99))

    def paint(self, canvas: Canvas, light: Light) -> None:
        """Walls with windows, and the roof, in the perspective of the scene."""
        columns = columns_around(math.atan2(self.y, self.x), self.half_angle)
        across = np.stack([np.cos(canvas.azimuth[columns]), np.sin(canvas.azimuth[columns])], axis=1)
        turned = np.array([[math.cos(self.turn), math.sin(self.turn)], [-math.sin(self.turn), math.cos(self.turn)]])
        ray, start = across @ turned.T, turned @ np.array([-self.x, -self.y])
        ray = np.where(np.abs(ray) < 1e-9, 1e-9, ray)
        near = (-np.sign(ray) * self.half - start) / ray
        far = (np.sign(ray) * self.half - start) / ray
        enter, leave = near.max(axis=1), far.min(axis=1)
        met = enter < leave
        if not met.any():
            return
        columns, ray, enter, leave, near = columns[met], ray[met], enter[met], leave[met], near[met]
        side = near.argmax(axis=1)
        along = (start + ray * enter[:, None])[np.arange(len(side)), 1 - side]
        normals = np.zeros((len(side), 3))
        normals[np.arange(len(side)), :2] = -np.sign(ray[np.arange(len(side)), side])[:, None] * turned[side]
        cosine = np.abs(ray[np.arange(len(side)), side])
        self._paint_roof(canvas, light, columns, (start, ray, turned, enter, leave))
        rows = canvas.rows(0.0, self.height_m, float(enter.min()), float(enter.max()))
        height = canvas.eye_m + canvas.slope[rows, None] * enter
        texel_m = TEXEL * enter
        cover = np.clip((self.height_m - height) / texel_m + 0.5, 0, 1) * np.clip(height / texel_m + 0.5, 0, 1)
        facing = light.on(normals)
        wall = self.wall * facing * (0.72 + 0.28 * np.clip(height / 6.0, 0, 1))[..., None]
        wall *= 1.0 + 0.12 * (sample(canvas.noise, along * 1.3 + self.seed, height * 1.3) - 0.5)[..., None]
        band = pulse(height % STOREY_M - STOREY_M + 0.1, 0.2, texel_m)
        wall *= 1.0 - 0.12 * band[..., None]
        color = self._with_windows(canvas, light, wall, along, height, texel_m, cosine, columns)
        color += light.night * 2.5e-5 * np.array([1.0, 0.75, 0.45]) * np.exp(-height / 4.0)[..., None]
        canvas.blend(rows, columns, canvas.hazy(color, enter, columns), cover)

    def _with_windows(
        self,
        canvas: Canvas,
        light: Light,
        wall: Array,
        along: Array,
        height: Array,
        texel_m: Array,
        cosine: Array,
        columns: npt.NDArray[np.integer],
    ) -> Array:
        pitch = self.window_m * 1.9
        slot, storey = np.floor(along / pitch), np.floor(height / STOREY_M)
        wide = texel_m / np.maximum(cosine, 0.15)
        glass = softened(along - (slot + 0.5) * pitch, self.window_m, wide, pitch)
        glass = glass * softened(height - (storey + 0.56) * STOREY_M, 1.55, texel_m, STOREY_M)
        glass *= (storey + 1) * STOREY_M <= self.height_m + 0.3
        frame = glass * (1.0 - softened(along - (slot + 0.5) * pitch, self.window_m - 0.18, wide, pitch))
        chance = hashed(slot.astype(np.int64) * 131 + storey.astype(np.int64) * 7919 + self.seed)
        mirrored = canvas.horizon[(columns + COLUMNS // 2) % COLUMNS]
        dark = mirrored * (0.1 + 0.16 * chance)[..., None] + 0.03 * light.on(np.array([[1.0, 0.0, 0.0]]))
        glow = light.night * (chance < LIT_SHARE) * (0.25 + 3.0 * chance)
        pane = dark + glow[..., None] * LIT_WINDOW
        color: Array = wall + glass[..., None] * (pane - wall)
        color += (frame * 0.5)[..., None] * (np.minimum(wall * 1.25, wall + 0.2) - color)
        return color

    def _paint_roof(
        self, canvas: Canvas, light: Light, columns: npt.NDArray[np.integer], rays: tuple[Array, ...]
    ) -> None:
        if self.roof <= 0.0:
            return
        start, ray, turned, enter, leave = rays
        steps = np.linspace(0.0, 1.0, 17)[:, None]
        distance = enter + (leave - enter) * steps
        place = np.abs(start + ray * distance[..., None])
        inset = np.clip(np.array(self.half) - place, 0.0, None)
        slopes = (self.height_m + self.roof * inset.min(axis=2) - canvas.eye_m) / distance
        best = slopes.argmax(axis=0)
        ridge = slopes.max(axis=0)
        # The slope that faces the scene is what is seen of a roof from below.
        side = np.array(inset[np.maximum(best // 2, 0), np.arange(len(best))].argmin(axis=1))
        out = -np.sign(ray[np.arange(len(side)), side])[:, None] * turned[side]
        normals = np.column_stack([out * self.roof, np.ones(len(side))]) / math.hypot(1.0, self.roof)
        eaves = (self.height_m - canvas.eye_m) / enter
        first, last = np.searchsorted(canvas.slope, [float(eaves.min()), float(ridge.max())])
        rows = slice(max(int(first) - 2, 0), min(int(last) + 2, len(canvas.slope)))
        cover = np.clip((ridge - canvas.slope[rows, None]) / TEXEL + 0.5, 0, 1)
        cover = cover * (canvas.slope[rows, None] > eaves - 2 * TEXEL)
        grain = sample(canvas.noise, columns * 0.9 + self.seed, np.arange(rows.start, rows.stop)[:, None] * 2.3)
        color = (self.tiles * light.on(normals))[None] * (0.85 + 0.3 * grain)[..., None]
        canvas.blend(rows, columns, canvas.hazy(color, enter, columns), cover)


def blocks(random: np.random.Generator) -> list[House]:
    """Return the houses of a town's blocks, around the yard that the scene is in."""
    found: list[House] = []
    for i in range(-FAR_BLOCKS, FAR_BLOCKS + 1):
        for j in range(-FAR_BLOCKS, FAR_BLOCKS + 1):
            away = math.hypot(i, j)
            if away > FAR_BLOCKS or (i, j) == (0, 0) or random.random() < (0.5 if away < 2 else 0.12):
                continue
            parts = 2 if away < 4 else 1
            size = (PITCH_M - STREET_M) / parts
            for part in range(parts * parts):
                x = i * PITCH_M + (part % parts - (parts - 1) / 2) * size
                y = j * PITCH_M + (part // parts - (parts - 1) / 2) * size
                storeys = int(random.integers(3, 6) + (random.random() < 0.06 * away) * random.integers(2, 9))
                half = tuple(0.5 * size - random.uniform(0.2, 3.0, 2) * (0.3 if parts == 2 else 1.0))
                found.append(
                    House(
                        x,
                        y,
                        (float(half[0]), float(half[1])),
                        0.0,
                        storeys * STOREY_M + 0.8,
                        0.0 if storeys > 5 or random.random() < 0.35 else float(random.uniform(0.35, 0.6)),
                        WALLS[random.integers(len(WALLS))] * random.uniform(0.8, 1.15),
                        ROOFS[random.integers(len(ROOFS))],
                        float(random.uniform(1.0, 1.7)),
                        int(random.integers(1 << 20)),
                    )
                )
    return found


def scattered_houses(count: int, between_m: tuple[float, float], random: np.random.Generator) -> list[House]:
    """Return lone houses with steep roofs."""
    houses: list[House] = []
    for k in range(count):
        angle = (k + random.uniform(0.1, 0.9)) * 2 * math.pi / count
        distance = random.uniform(between_m[0] * 0.95, between_m[1] * 0.6)
        houses.append(
            House(
                distance * math.cos(angle),
                distance * math.sin(angle),
                (float(random.uniform(5.5, 8.5)), float(random.uniform(4.0, 5.5))),
                float(random.uniform(0, math.pi)),
                STOREY_M * int(random.integers(1, 3)) + 0.6,
                float(random.uniform(0.7, 1.0)),
                WALLS[random.integers(3)] * random.uniform(0.9, 1.15),
                ROOFS[random.integers(len(ROOFS))],
                float(random.uniform(1.1, 1.5)),
                int(random.integers(1 << 20)),
            )
        )
    return houses


def streets(x: Array, y: Array, texel_m: Array) -> tuple[Array, Array]:
    """Shares of street and of pavement, of places on the ground."""
    offset = [np.abs((value / PITCH_M) % 1.0 - 0.5) * PITCH_M for value in (x, y)]
    road, walk = (
        np.maximum(*(softened(value, width, texel_m, PITCH_M) for value in offset))
        for width in (STREET_M * 0.6, STREET_M)
    )
    return road, np.clip(walk - road, 0.0, 1.0)
