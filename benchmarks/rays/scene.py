"""A furnished room of as many triangles as wanted, made from a seed.

Six by five metres, a door opening to the dark, a ceiling lamp and a window that both glow, tables and chairs of boxes,
and curved things (balls, rings, vases, cans, cushions) that share out the triangles.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import Instance, Material, SceneGeometry

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Shape = Callable[[Floats, Floats], Floats]

WIDTH_M, DEPTH_M, HEIGHT_M = 6.0, 5.0, 2.8
CURVED_THINGS = 48
LAMP_LOW_M, LAMP_HIGH_M = (2.6, 2.1, 2.66), (3.4, 2.9, 2.7)
LAMP_EMISSION = (18.0, 16.0, 13.0)
WINDOW_EMISSION = (3.0, 3.6, 4.5)


@dataclass
class Builder:
    """Collects things, an instance and a material each."""

    vertices: list[Floats] = field(default_factory=list)
    triangles: list[Ints] = field(default_factory=list)
    owners: list[int] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    first_vertex: int = 0

    def add(self, name: str, parts: list[tuple[Floats, Ints]], material: Material) -> None:
        """Add an instance made of parts: vertices (V, 3) and triangles (T, 3)."""
        self.instances.append(Instance(len(self.instances) + 1, f"{name} {len(self.instances)}", name))
        self.materials.append(material)
        for vertices, triangles in parts:
            self.vertices.append(vertices)
            self.triangles.append(triangles + self.first_vertex)
            self.owners += [len(self.instances)] * len(triangles)
            self.first_vertex += len(vertices)

    def finish(self) -> SceneGeometry:
        """Everything that was added."""
        vertices = np.concatenate(self.vertices).astype(np.float32)
        triangles = np.concatenate(self.triangles).astype(np.int32)
        owners = np.array(self.owners, np.int32)
        return SceneGeometry(
            vertices=vertices,
            triangles=triangles,
            triangle_instance=owners,
            triangle_material=owners - 1,
            normals=_vertex_normals(vertices, triangles),
            uvs=np.zeros((len(vertices), 2), np.float32),
            materials=tuple(self.materials),
            instances=tuple(self.instances),
        )


def generate(triangles: int, seed: int = 0) -> SceneGeometry:
    """About that many triangles (at least some thousand), the same ones for the same seed."""
    random = np.random.default_rng(seed)
    builder = Builder()
    _add_room(builder)
    tables = _add_furniture(builder, random)
    flat = sum(len(part) for part in builder.triangles)
    rows = max(round(np.sqrt(max(triangles - flat, 0) / CURVED_THINGS / 4)), 3)
    for number in range(CURVED_THINGS):
        shape, name, size = _curved(number, random)
        vertices, faces = _tessellate(shape, rows, 2 * rows)
        if number % 3 == 0:
            place = tables[number // 3 % len(tables)] + np.array([*random.uniform(-0.45, 0.45, 2), size[2]])
        else:
            place = np.array([*random.uniform((0.4, 0.4), (WIDTH_M - 0.4, DEPTH_M - 0.4)), size[2]])
            place[2] += random.choice([0.0, 0.0, 0.9, 1.5])
        builder.add(name, [(vertices * size @ _turn(random) + place, faces)], _paint(random))
    return builder.finish()


def _add_room(builder: Builder) -> None:
    wall, floor = Material("wall", (0.72, 0.7, 0.65)), Material("floor", (0.45, 0.33, 0.22))
    width, depth, height, thick = WIDTH_M, DEPTH_M, HEIGHT_M, 0.1
    builder.add("floor", [box((-thick, -thick, -thick), (width + thick, depth + thick, 0))], floor)
    builder.add("ceiling", [box((-thick, -thick, height), (width + thick, depth + thick, height + thick))], wall)
    builder.add("wall", [box((-thick, 0, 0), (0, depth, height))], wall)
    builder.add("wall", [box((0, -thick, 0), (width, 0, height))], wall)
    builder.add("wall", [box((0, depth, 0), (width, depth + thick, height))], wall)
    door = [((width, 0, 0), (width + thick, 2, height)), ((width, 3, 0), (width + thick, depth, height))]
    builder.add("wall", [box(*part) for part in [*door, ((width, 2, 2.1), (width + thick, 3, height))]], wall)
    builder.add("lamp", [box(LAMP_LOW_M, LAMP_HIGH_M)], Material("lamp", (0, 0, 0), emission=LAMP_EMISSION))
    pane = box((1.5, depth - 0.03, 0.9), (3.5, depth - 0.01, 2.1))
    builder.add("window", [pane], Material("window", (0, 0, 0), emission=WINDOW_EMISSION))


def _add_furniture(builder: Builder, random: np.random.Generator) -> list[Floats]:
    """Three tables and nine chairs; returns the middles of the table tops."""
    tops = []
    for x, y in ((1.2, 1.2), (1.4, 3.6), (4.5, 3.4)):
        legs = [(x + dx, y + dy) for dx in (-0.7, 0.65) for dy in (-0.5, 0.45)]
        boards = [box((x - 0.75, y - 0.55, 0.7), (x + 0.75, y + 0.55, 0.74))]
        boards += [box((a, b, 0), (a + 0.05, b + 0.05, 0.7)) for a, b in legs]
        builder.add("table", boards, _paint(random))
        tops.append(np.array([x, y, 0.74]))
        for dx, dy in ((-1.0, 0.0), (1.0, 0.1), (0.1, -0.85)):
            a, b = x + dx, y + dy
            seat = [box((a - 0.2, b - 0.2, 0.42), (a + 0.2, b + 0.2, 0.46))]
            seat += [
                box((a + i, b + j, 0), (a + i + 0.04, b + j + 0.04, 0.42)) for i in (-0.2, 0.16) for j in (-0.2, 0.16)
            ]
            seat += [box((a - 0.2, b + 0.17, 0.46), (a + 0.2, b + 0.2, 0.9))]
            builder.add("chair", seat, _paint(random))
    return tops


def _paint(random: np.random.Generator) -> Material:
    red, green, blue = (float(value) for value in random.uniform(0.1, 0.8, 3))
    return Material("paint", (red, green, blue))


def _turn(random: np.random.Generator) -> Floats:
    angle = random.uniform(0, 2 * np.pi)
    return np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])


def _curved(number: int, random: np.random.Generator) -> tuple[Shape, str, Floats]:
    """A surface over two angles within a cube of half width 1, what to call it, and its half sizes in metres."""
    size = random.uniform(0.06, 0.22, 3)
    if number % 5 == 0:
        return _superellipsoid(1.0), "ball", np.full(3, size[0])
    if number % 5 == 1:
        return _ring(random.uniform(0.2, 0.4)), "ring", size[[0, 0, 1]] * (1, 1, 0.8)
    if number % 5 == 2:
        return _vase(random.uniform(0.2, 0.35), random.uniform(2, 6)), "vase", size[[0, 0, 1]]
    if number % 5 == 3:
        return _superellipsoid(0.12), "can", size
    return _superellipsoid(random.uniform(0.3, 0.7)), "cushion", size


def _superellipsoid(exponent: float) -> Shape:
    """Barr, "Superquadrics and angle-preserving transformations", 1981; 1 is a sphere, towards 0 a box."""

    def power(value: Floats) -> Floats:
        size = np.where(np.abs(value) < 1e-9, 0.0, np.abs(value))  # or seams and poles would not close
        return np.asarray(np.sign(value) * size**exponent)

    def at(u: Floats, v: Floats) -> Floats:
        across, up = 2 * np.pi * u, np.pi * (v - 0.5)
        ring = power(np.cos(up))
        return np.stack([ring * power(np.cos(across)), ring * power(np.sin(across)), power(np.sin(up))], axis=-1)

    return at


def _ring(thickness: float) -> Shape:
    def at(u: Floats, v: Floats) -> Floats:
        across, around = 2 * np.pi * u, 2 * np.pi * v
        radius = 1 - thickness + thickness * np.cos(around)
        return np.stack([radius * np.cos(across), radius * np.sin(across), np.sin(around)], axis=-1)

    return at


def _vase(waist: float, waves: float) -> Shape:
    def at(u: Floats, v: Floats) -> Floats:
        across = 2 * np.pi * u
        radius = (1 - waist + waist * np.cos(waves * v)) * np.minimum(1, 20 * v) * np.minimum(1, 20 * (1 - v))
        return np.stack([radius * np.cos(across), radius * np.sin(across), 2 * v - 1], axis=-1)

    return at


def _tessellate(shape: Shape, rows: int, columns: int) -> tuple[Floats, Ints]:
    v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
    vertices = shape(u, v).reshape(-1, 3)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)[None, :]).ravel()
    right, above = first + 1, first + columns + 1
    faces = np.concatenate([np.stack([first, right, above + 1], 1), np.stack([first, above + 1, above], 1)])
    corner = vertices[faces]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return vertices, faces[area > 1e-9]


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> tuple[Floats, Ints]:
    """Eight corners for each of three directions, so that normals stay flat."""
    corner = np.array([[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)], float)
    quads = [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]
    faces = [(4 * k + a, 4 * k + b, 4 * k + c) for k in range(6) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    return corner[np.array(quads).ravel()], np.array(faces)


def _vertex_normals(vertices: npt.NDArray[np.float32], triangles: npt.NDArray[np.int32]) -> npt.NDArray[np.float32]:
    """Area-weighted means of the adjoining triangles."""
    corner = vertices[triangles].astype(np.float64)
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(cross[:, i], 3), len(vertices)) for i in range(3)], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    unit = np.divide(total, length, out=np.zeros_like(total), where=length > 0)
    unit[length[:, 0] == 0] = (0, 0, 1)
    normals: npt.NDArray[np.float32] = unit.astype(np.float32)
    return normals
