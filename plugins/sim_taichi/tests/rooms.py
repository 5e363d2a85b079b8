"""Scenes that the tests look at, and their light by night."""

from pathlib import Path

import numpy as np

from benchbot_sim_taichi.lighting import Lighting, Sky, Sun
from plugins.sim_taichi.tests.glb import Glb, sphere

NIGHT = Lighting(sun=Sun(irradiance=(0.0,) * 3), sky=Sky(*[(0.0,) * 3] * 3), exposure=1.0)


def checkers(first: tuple[int, int, int], second: tuple[int, int, int]) -> np.ndarray:
    """A 64x64 image of 8x8 squares."""
    parity = (np.arange(64)[:, None] // 8 + np.arange(64)[None, :] // 8) % 2
    return np.where(parity[..., None] == 0, np.array(first), np.array(second)).astype(np.uint8)


def furnished_room(path: Path, pane_color: tuple[float, float, float] = (0.85, 0.95, 0.9)) -> Path:
    """4 x 3 x 2.5 m; window in the wall at y = 3; table, spheres, lamp."""
    glb = Glb()
    plaster = glb.material((0.75, 0.73, 0.68))
    floor = glb.material(roughness=0.35, image=checkers((150, 100, 60), (130, 84, 48)))
    wood = glb.material((0.45, 0.25, 0.12), roughness=0.4)
    red = glb.material((0.7, 0.1, 0.08), roughness=0.8)
    steel = glb.material((0.8, 0.8, 0.82), roughness=0.1, metallic=1.0)
    pane = glb.material(pane_color, glass=True, roughness=0.0)
    bulb = glb.material(emission=(12.0, 9.0, 6.0))
    glb.box("floor", (-0.1, -0.1, -0.1), (4.1, 3.1, 0.0), floor)
    glb.box("ceiling", (-0.1, -0.1, 2.5), (4.1, 3.1, 2.6), plaster)
    glb.box("wall west", (-0.1, -0.1, 0.0), (0.0, 3.1, 2.5), plaster)
    glb.box("wall east", (4.0, -0.1, 0.0), (4.1, 3.1, 2.5), plaster)
    glb.box("wall south", (0.0, -0.1, 0.0), (4.0, 0.0, 2.5), plaster)
    glb.box("wall north low", (0.0, 3.0, 0.0), (4.0, 3.1, 0.9), plaster)
    glb.box("wall north high", (0.0, 3.0, 2.1), (4.0, 3.1, 2.5), plaster)
    glb.box("wall north left", (0.0, 3.0, 0.9), (1.2, 3.1, 2.1), plaster)
    glb.box("wall north right", (2.8, 3.0, 0.9), (4.0, 3.1, 2.1), plaster)
    glb.box("pane", (1.2, 3.045, 0.9), (2.8, 3.055, 2.1), pane)
    glb.box("bar", (1.97, 3.02, 0.9), (2.03, 3.08, 2.1), plaster)
    glb.box("table top", (2.2, 1.2, 0.70), (3.4, 2.0, 0.74), wood, class_name="table")
    for index, (x, y) in enumerate([(2.25, 1.25), (3.3, 1.25), (2.25, 1.9), (3.3, 1.9)]):
        glb.box(f"leg {index}", (x, y, 0.0), (x + 0.05, y + 0.05, 0.7), wood, class_name="table")
    glb.sphere("ball", (2.6, 1.6, 0.86), 0.12, red, class_name="sports_ball")
    glb.sphere("kettle", (3.0, 1.5, 0.83), 0.09, steel, class_name="kettle")
    glb.box("chest", (0.05, 1.0, 0.0), (0.5, 2.0, 0.8), red)
    glb.sphere("bulb", (1.0, 0.8, 2.35), 0.06, bulb, 12)
    return glb.write(path)


def short_corridor(path: Path) -> Path:
    """A corridor of 1.2 x 3 x 2 m of dark, dull plaster, lit through a pane that closes it towards y = 3."""
    glb = Glb()
    plaster = glb.material((0.3,) * 3, roughness=0.6)
    for name, low, high in (
        ("floor", (-0.1, -0.1, -0.1), (1.3, 3.0, 0.0)),
        ("ceiling", (-0.1, -0.1, 2.0), (1.3, 3.0, 2.1)),
        ("west", (-0.1, 0.0, 0.0), (0.0, 3.0, 2.0)),
        ("east", (1.2, 0.0, 0.0), (1.3, 3.0, 2.0)),
        ("south", (0.0, -0.1, 0.0), (1.2, 0.0, 2.0)),
    ):
        glb.box(name, low, high, plaster)
    glb.box("pane", (0.0, 2.95, 0.0), (1.2, 2.96, 2.0), glb.material((1.0,) * 3, glass=True, roughness=0.0))
    return glb.write(path)


def dull_room(path: Path) -> Path:
    """A closed room of 2.4 x 6 x 2.5 m, all dull; a ball of a lamp hangs in its middle, 32 cm below the ceiling."""
    glb = Glb()
    glb.box("walls", (-1.2, -3.0, 0.0), (1.2, 3.0, 2.5), glb.material((0.6,) * 3, roughness=0.6), inward=True)
    glb.box("floor", (-1.2, -3.0, 0.0), (1.2, 3.0, 0.01), glb.material((0.4,) * 3, roughness=0.6))
    glb.sphere("lamp", (0.0, 0.0, 2.1), 0.08, glb.material((0.0,) * 3, emission=(12.0, 9.0, 6.0)), 12)
    return glb.write(path)


def lit_box(path: Path, albedo: float, radiance: float, radius: float, width: float) -> Path:
    """A closed cube with a spherical lamp in its middle."""
    glb = Glb()
    half = width / 2
    glb.box("walls", (-half,) * 3, (half,) * 3, glb.material((albedo,) * 3), inward=True)
    glb.sphere("lamp", (0, 0, 0), radius, glb.material((0, 0, 0), emission=(radiance,) * 3), 24)
    return glb.write(path)


def ceiling_lamp(path: Path, gap_m: float = 0.01) -> Path:
    """A closed room of 6 x 5 x 2.7 m; a lamp of 40 x 40 x 5 cm glows all around, `gap_m` below the ceiling."""
    glb = Glb()
    glb.box("walls", (-3, -2.5, 0), (3, 2.5, 2.7), glb.material((0.6,) * 3), inward=True)
    glb.box("lamp", (-0.2, -0.2, 2.65 - gap_m), (0.2, 0.2, 2.7 - gap_m), glb.material((0.8,) * 3, emission=(10.0,) * 3))
    return glb.write(path)


def lamp_on_its_canopy(path: Path) -> Path:
    """A closed room of 6 x 5 x 2.7 m; a canopy of 30 x 30 cm reaches into its ceiling, and a lamp hangs below it."""
    glb = Glb()
    glb.box("walls", (-3, -2.5, 0), (3, 2.5, 2.7), glb.material((0.6,) * 3), inward=True)
    glb.box("canopy", (-0.15, -0.15, 2.6), (0.15, 0.15, 2.75), glb.material((0.8,) * 3))
    glb.box("lamp", (-0.1, -0.1, 2.5), (0.1, 0.1, 2.59), glb.material((0.8,) * 3, emission=(10.0,) * 3))
    return glb.write(path)


def picture_on_a_wall(path: Path) -> Path:
    """A closed room; a picture of 60 x 40 x 3 cm on its wall at y = 0, from z = 1.2 up, and a lamp above before it."""
    glb = Glb()
    glb.box("walls", (-2, -3, 0), (2, 0, 2.5), glb.material((0.5,) * 3), inward=True)
    glb.box("picture", (-0.3, -0.03, 1.2), (0.3, 0, 1.6), glb.material((0.3,) * 3))
    glb.box("lamp", (-0.1, -0.9, 2.3), (0.1, -0.7, 2.4), glb.material((0.8,) * 3, emission=(10.0,) * 3))
    return glb.write(path)


def sill_below_a_roof(path: Path) -> Path:
    """A wall at y = 0; a roof shades it down to z = 0.87 from a sun 60° high, not all of a sill of 15 cm at z = 1."""
    glb = Glb()
    plaster = glb.material((0.7,) * 3)
    glb.box("wall", (-2, 0, 0), (2, 0.1, 2.1), plaster)
    glb.box("roof", (-2, -0.65, 2.0), (2, 0, 2.1), glb.material((0.0,) * 3))
    glb.box("sill", (-0.5, -0.15, 0.97), (0.5, 0, 1.0), plaster)
    return glb.write(path)


def lit_and_dark_room(path: Path) -> Path:
    """Two rooms of 2 x 2 x 2 m under one ceiling, parted by a wall of 6 cm about x = 0; a lamp is in that of x < 0."""
    glb = Glb()
    plaster = glb.material((0.8,) * 3)
    for axis, name in enumerate("xyz"):
        for end, place in (("low", -1.0), ("high", 1.0)):
            low, high = [-2.2, -1.2, -1.2], [2.2, 1.2, 1.2]
            low[axis], high[axis] = sorted((place * (2.0 if axis == 0 else 1.0), place * (2.2 if axis == 0 else 1.2)))
            glb.box(f"{name} {end}", tuple(low), tuple(high), plaster)
    glb.box("wall", (-0.03, -1.0, -1.0), (0.03, 1.0, 1.0), plaster)
    glb.box("lamp", (-1.1, -0.1, -0.1), (-0.9, 0.1, 0.1), glb.material((0.8,) * 3, emission=(10.0,) * 3))
    return glb.write(path)


def bottle(path: Path) -> Path:
    """Two shells of clear glass about the origin, of 20 and 19 cm radius."""
    glb = Glb()
    glass = glb.material((1.0,) * 3, glass=True, roughness=0.0)
    vertices, triangles, normals = sphere(48)
    shells = np.concatenate([vertices * 0.2, vertices * 0.19])
    both = np.concatenate([triangles, triangles + len(vertices)])
    glb.add("bottle", shells, both, glass, normals=np.concatenate([normals, normals]))
    return glb.write(path)


def room_by_night(path: Path) -> Path:
    """A room of 4 x 3 x 2.5 m, open behind a pane towards y = 3; a smooth floor, a shade that glows inside too."""
    glb = Glb()
    plaster = glb.material((0.8,) * 3)
    outer = ((-0.1, -0.1, -0.1), (4.1, 3.0, 2.6))
    for axis, name in enumerate("xyz"):
        for end in (0, 1):
            low, high = [list(corner) for corner in outer]
            low[axis], high[axis] = (outer[0][axis], 0.0) if end == 0 else ((4.0, 3.0, 2.5)[axis], outer[1][axis])
            if (name, end) == ("z", 0):
                glb.box("floor", low, high, glb.material((0.4, 0.3, 0.2), roughness=0.3))
            elif (name, end) != ("y", 1):
                glb.box(f"wall {name}{end}", low, high, plaster)
    glb.box("pane", (0.0, 2.9, 0.0), (4.0, 2.91, 2.5), glb.material((1.0,) * 3, glass=True, roughness=0.0))
    shade = glb.material((0.8,) * 3, emission=(10.0,) * 3)
    for index, (x, y) in enumerate([(-0.15, 0.0), (0.15, 0.0), (0.0, -0.15), (0.0, 0.15)]):
        across = (0.005, 0.15) if x else (0.145, 0.005)
        glb.box(
            f"shade {index}",
            (2.0 + x - across[0], 1.2 + y - across[1], 1.7),
            (2.0 + x + across[0], 1.2 + y + across[1], 1.95),
            shade,
        )
    return glb.write(path)


def polished_room(path: Path) -> Path:
    """A black room of 4 x 3 x 2.5 m with a smooth floor and a white ceiling; below 1 m it is a pane towards y = 3."""
    glb = Glb()
    black = glb.material((0.01,) * 3)
    for name, low, high, material in (
        ("floor", (-0.1, -0.1, -0.1), (4.1, 3.1, 0.0), glb.material((0.01,) * 3, roughness=0.4)),
        ("ceiling", (-0.1, -0.1, 2.5), (4.1, 3.1, 2.6), glb.material((0.8,) * 3)),
        ("west", (-0.1, 0.0, 0.0), (0.0, 3.0, 2.5), black),
        ("east", (4.0, 0.0, 0.0), (4.1, 3.0, 2.5), black),
        ("south", (-0.1, -0.1, 0.0), (4.1, 0.0, 2.5), black),
        ("north", (-0.1, 3.0, 1.0), (4.1, 3.1, 2.5), black),
        ("pane", (0.0, 3.02, 0.0), (4.0, 3.03, 1.0), glb.material((1.0,) * 3, glass=True, roughness=0.0)),
    ):
        glb.box(name, low, high, material)
    return glb.write(path)


def sill_above_a_slot(path: Path) -> Path:
    """A wall of 2 x 0.9 m towards -y, a sill of 3 cm that lies 2 cm above it and juts out by 3 cm, closed behind."""
    glb = Glb()
    plaster = glb.material((0.8,) * 3)
    glb.box("wall", (0.0, 0.0, 0.0), (2.0, 0.3, 0.9), plaster)
    glb.box("sill", (0.0, -0.03, 0.92), (2.0, 0.35, 0.95), plaster)
    glb.box("back", (0.0, 0.3, 0.0), (2.0, 0.35, 0.92), plaster)
    return glb.write(path)


def ball_of_two_shells(path: Path) -> Path:
    """A ball of 20 cm radius at the origin, with another of the same object 16 mm below it; both are sheets."""
    glb = Glb()
    sheet = glb.material((0.6,) * 3)
    glb.materials[sheet]["doubleSided"] = True
    vertices, triangles, normals = sphere(48)
    shells = np.concatenate([vertices * 0.184, vertices * 0.2])
    both = np.concatenate([triangles, triangles + len(vertices)])
    glb.add("ball", shells, both, sheet, normals=np.concatenate([normals, normals]))
    return glb.write(path)


def plaza(path: Path) -> Path:
    """A grey floor under the open sky with a pole of 1 m at the origin."""
    glb = Glb()
    grey = glb.material((0.5, 0.5, 0.5))
    glb.box("floor", (-4, -4, -0.2), (4, 4, 0.0), grey)
    glb.box("pole", (-0.1, -0.1, 0.0), (0.1, 0.1, 1.0), grey, class_name="pole")
    return glb.write(path)


def fence(path: Path) -> Path:
    """A card at x = 2 whose right half (y < 0) is cut away, before a wall at x = 3; a pane at x = 1 for y > 0."""
    glb = Glb()
    image = np.full((64, 64, 4), 255, np.uint8)
    image[:, 32:, 3] = 0
    cut = glb.material(image=image)
    glb.materials[cut]["alphaMode"] = "MASK"
    card = np.array([[2, 1, 0], [2, -1, 0], [2, -1, 2], [2, 1, 2]], float)
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)
    glb.add("card", card, quad, cut, uvs=uvs, class_name="card")
    glb.add("pane", card - [1, 0, 0] + [0, 1, 0], quad, glb.material(glass=True), class_name="pane")
    glb.box("wall", (3, -9, -3), (3.1, 9, 5), glb.material())
    return glb.write(path)


def board_above_slats(path: Path, height_m: float) -> Path:
    """A floor of 2 x 2 m with slats 1 cm wide every 6 cm, and a board of 40 x 40 cm one metre above; all matt."""
    glb = Glb()
    matt = glb.material((0.6,) * 3, ior=1.0)
    glb.box("floor", (-1, -1, -0.1), (1, 1, 0), matt)
    for index, x in enumerate(np.arange(-0.95, 0.95, 0.06)):
        glb.box(f"slat {index}", (x, -1, 0), (x + 0.01, 1, height_m), matt)
    glb.box("board", (-0.2, -0.2, 1.0), (0.2, 0.2, 1.02), matt)
    return glb.write(path)


def room_with_a_dark_board(path: Path) -> Path:
    """4 x 4 x 2.5 m; a smooth dark wall at y = 2, and an opening of 80 x 80 cm across from it."""
    glb = Glb()
    plaster, board = glb.material((0.6,) * 3), glb.material((0.03,) * 3, roughness=0.35)
    glb.box("floor", (-2, -2, -0.1), (2, 2, 0), plaster)
    glb.box("ceiling", (-2, -2, 2.5), (2, 2, 2.6), plaster)
    glb.box("wall west", (-2.1, -2, 0), (-2, 2, 2.5), plaster)
    glb.box("wall east", (2, -2, 0), (2.1, 2, 2.5), plaster)
    glb.box("board", (-2, 2, 0), (2, 2.1, 2.5), board)
    glb.box("wall south low", (-2, -2.1, 0), (2, -2, 1), plaster)
    glb.box("wall south high", (-2, -2.1, 1.8), (2, -2, 2.5), plaster)
    glb.box("wall south left", (-2, -2.1, 1), (-0.4, -2, 1.8), plaster)
    glb.box("wall south right", (0.4, -2.1, 1), (2, -2, 1.8), plaster)
    return glb.write(path)
