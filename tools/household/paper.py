"""Paper and what belongs to it: loose sheets, waste bins, magnets on a refrigerator; the user's side faces +x."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tools.household import materials
from tools.household.model import Material, Mesh, Model, Part, merge, moved, rotated
from tools.household.planks import board
from tools.household.shapes import bevelled_box, ellipsoid, grid_surface, lathe
from tools.household.textures import linear_color, notes


def _sheet(width_m: float, height_m: float, curl_m: float, rows: int = 4) -> Mesh:
    """A sheet in the plane y-z that looks to +x, its lower edge standing off by `curl_m`; shows its picture once."""
    share = np.linspace(1.0, 0.0, rows)
    y, z = np.meshgrid([-width_m / 2, width_m / 2], share * height_m)
    off = np.repeat((curl_m * (1.0 - share) ** 2)[:, None], 2, axis=1)
    return grid_surface(np.stack([off, y, z], axis=2), np.stack([y + width_m / 2, z], axis=2))


def _hung(mesh: Mesh, y: float, z: float, turn_deg: float) -> Mesh:
    return moved(rotated(mesh, "x", turn_deg), 0.0015, y, z)


def _disc(y: float, z: float, radius_m: float = 0.014) -> Mesh:
    profile = [(radius_m, 0.0), (radius_m, 0.006), (radius_m * 0.8, 0.009), (0.0, 0.009)]
    return moved(rotated(lathe(profile, 9, crease_deg=50.0), "y", 90.0), 0.0, y, z)


def _letter(strokes: Sequence[tuple[float, float, float, float]], y: float, z: float) -> Mesh:
    """A letter of bars (from y, z to y, z), 45 mm high."""
    bars = []
    for y0, z0, y1, z1 in strokes:
        length = float(np.hypot(y1 - y0, z1 - z0)) + 0.010
        bar = rotated(
            board((0.0, -length / 2, -0.005), (0.007, length / 2, 0.005), 0.002),
            "x",
            float(np.degrees(np.arctan2(z1 - z0, y1 - y0))),
        )
        bars.append(moved(bar, 0.0, (y0 + y1) / 2, (z0 + z1) / 2))
    return moved(merge(bars), 0.0, y, z)


_A = ((-0.016, 0.0, 0.0, 0.04), (0.016, 0.0, 0.0, 0.04), (-0.009, 0.015, 0.009, 0.015))
_L = ((-0.010, 0.0, -0.010, 0.04), (-0.010, 0.0, 0.014, 0.0))
_T = ((0.0, 0.0, 0.0, 0.04), (-0.016, 0.04, 0.016, 0.04))


def magnets_and_sheets() -> Model:
    """A child's drawing and a shopping list, held by round magnets."""
    picture, note = notes.drawing_of_a_child(0.21, 0.148), notes.shopping_list(0.085, 0.12)
    return (
        Part(
            _hung(_sheet(0.21, 0.148, 0.010), -0.03, 0.10, 3.0),
            Material("drawing", base_color_texture=picture, roughness=0.8, double_sided=True),
        ),
        Part(
            _hung(_sheet(0.085, 0.12, 0.014), 0.055, -0.05, -5.0),
            Material("note", base_color_texture=note, roughness=0.8, double_sided=True),
        ),
        Part(merge([_disc(-0.115, 0.238), _disc(0.060, 0.060)]), materials.paint("#a8332b", 0.35)),
        Part(merge([_disc(0.052, 0.244), _disc(-0.07, 0.02, 0.018)]), materials.paint("#2f5f8f", 0.35)),
    )


def magnets_and_letters() -> Model:
    """Three letters and some round magnets."""
    return (
        Part(_letter(_L, -0.075, 0.05), materials.paint("#c8412f", 0.35)),
        Part(merge([_letter(_A, -0.02, 0.062), _disc(0.075, 0.0, 0.018)]), materials.paint("#e0b63a", 0.35)),
        Part(merge([_letter(_T, 0.045, 0.045), _disc(-0.05, 0.0)]), materials.paint("#3f7fa8", 0.35)),
        Part(_disc(0.01, 0.015, 0.012), materials.paint("#4f8a55", 0.35)),
    )


def _crumpled(radius_m: float, seed: int) -> Mesh:
    """A crumpled sheet of paper."""
    rng = np.random.default_rng(seed)
    ball = ellipsoid((radius_m, radius_m, radius_m * 0.85), 8, 5)
    _, same = np.unique(ball.vertices.round(5), axis=0, return_inverse=True)
    stretch = rng.uniform(0.72, 1.12, int(same.max()) + 1)[same.ravel()]
    return Mesh(ball.vertices * stretch[:, None], ball.triangles, ball.normals, ball.uvs)


def paper_bin() -> Model:
    """An open waste-paper basket, half full."""
    profile = [(0.0, 0.0), (0.108, 0.0), (0.140, 0.296), (0.138, 0.300), (0.134, 0.297), (0.110, 0.08), (0.0, 0.08)]
    wall = lathe(profile, 24)
    places = ((0.055, 0.03, 0.20), (-0.05, 0.04, 0.21), (0.0, -0.06, 0.22), (0.01, 0.02, 0.26))
    balls = [moved(_crumpled(0.056, seed), *place) for seed, place in enumerate(places)]
    return Part(wall, materials.paint("#3a3d40", 0.5)), Part(merge(balls), materials.paint("#efeee9", 0.9))


def pedal_bin() -> Model:
    """A round pedal bin with a domed lid; its pedal at +x."""
    body = lathe([(0.0, 0.020), (0.124, 0.020), (0.125, 0.335), (0.121, 0.338)], 24)
    dark = lathe([(0.0, 0.0), (0.128, 0.0), (0.130, 0.022), (0.125, 0.024)], 24)
    lid = lathe([(0.128, 0.336), (0.129, 0.352), (0.118, 0.372), (0.070, 0.388), (0.0, 0.393)], 24)
    pedal = bevelled_box((0.060, 0.050, 0.010), (0.150, 0.0, 0.014), 0.004)
    steel = Material("bin body", linear_color("#c9cbcc"), roughness=0.32, metallic=1.0)
    return Part(body, steel), Part(merge([dark, lid, pedal]), materials.paint("#2a2b2d", 0.4))


def loose_paper() -> Model:
    """Some sheets of A4 that lie on each other askew, the uppermost printed."""
    width, length = 0.21, 0.297
    stack = []
    for left, ahead, z, turn_deg in ((0.0, 0.0, 0.0, 4.0), (0.012, -0.018, 0.003, -7.0), (-0.006, 0.010, 0.006, 9.0)):
        thick = 0.003 if z < 0.006 else 0.001
        sheets = bevelled_box((width, length, thick), (0.0, 0.0, thick / 2), 0.0002)
        stack.append(moved(rotated(sheets, "z", 90.0 + turn_deg), left, ahead, z))
    x, y = np.meshgrid([-width / 2, width / 2], [length / 2, -length / 2])
    uvs = np.stack([x + width / 2, y + length / 2], axis=2)
    flat = grid_surface(np.stack([x, y, np.zeros_like(x)], axis=2), uvs)
    page = Material("page", base_color_texture=notes.printed_page(width, length), roughness=0.85)
    return (
        Part(merge(stack), materials.paint("#eeece5", 0.9)),
        Part(moved(rotated(flat, "z", 99.0), -0.006, 0.010, 0.0074), page),
    )
