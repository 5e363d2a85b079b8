"""Knives, forks and spoons, lying flat, tips to -x, away from the diner at +x."""

from __future__ import annotations

import numpy as np

from tools.household import materials
from tools.household.model import Floats, Material, Mesh, Model, Part, merge, moved
from tools.household.shapes import grid_surface, tube

_STEEL = Material("cutlery steel", base_color=(0.62, 0.62, 0.60), roughness=0.16, metallic=1.0)

Stations = tuple[tuple[float, float, float, float], ...]


def _leaf(stations: Stations, dish: dict[float, float] | None = None, columns: int = 9) -> Mesh:
    """A flat body of lens-shaped section along x: stations of (x, half width, height, thickness).

    `dish` gives depths of a hollow by x.
    """
    x, half, height, thick = np.array(stations).T
    across = np.linspace(-1, 1, columns)
    hollow = np.zeros(len(x)) if dish is None else np.interp(x, sorted(dish), [dish[key] for key in sorted(dish)])
    y = half[:, None] * across
    middle = height[:, None] - hollow[:, None] * (1 - across**2)
    lens = thick[:, None] / 2 * (1 - across**4)
    upper = np.stack(np.broadcast_arrays(x[:, None], y, middle + lens), axis=2)
    lower = np.stack(np.broadcast_arrays(x[:, None], y, middle - lens), axis=2)
    return merge([grid_surface(upper[::-1, ::-1], crease_deg=60.0), grid_surface(lower[:, ::-1], crease_deg=60.0)])


def _handle(length: float, width: float) -> Stations:
    """A spatulate handle from the neck at x = 0 to its end at +x."""
    shares = (
        (0.0, 0.30, 0.006, 0.0035),
        (0.25, 0.32, 0.009, 0.0035),
        (0.6, 0.55, 0.006, 0.003),
        (0.85, 0.95, 0.002, 0.0025),
        (0.96, 0.9, 0.001, 0.0022),
        (1.0, 0.35, 0.001, 0.001),
    )
    return tuple((length * share, width / 2 * wide, z, thick) for share, wide, z, thick in shares)


def spoon(length: float, bowl: float, handle: Material | None = None) -> Model:
    """A spoon whose bowl is `bowl` long."""
    stem = _handle(length - bowl, 0.020)
    wide = bowl * 0.33
    head = [(-bowl, 0.0008, 0.009, 0.0006)]
    shares = np.array([0.96, 0.85, 0.65, 0.42, 0.22, 0.08])
    widths = wide * np.sqrt(np.sin(np.pi * shares**0.8))
    head += [(-bowl * float(share), float(half), 0.009, 0.0018) for share, half in zip(shares, widths, strict=True)]
    depth = {-bowl: 0.0, -bowl * 0.85: bowl * 0.10, -bowl * 0.5: bowl * 0.16, -bowl * 0.15: bowl * 0.06, 0.0: 0.0}
    if handle is None:
        return (Part(_leaf((*head, *stem), depth), _STEEL),)
    return Part(_leaf((*head, stem[0], stem[1]), depth), _STEEL), Part(_thick_handle(stem), handle)


def _thick_handle(stem: Stations) -> Mesh:
    end = stem[-1][0]
    line = np.array([(share * end, 0.0, 0.007 - 0.003 * share) for share in (0.10, 0.16, 0.5, 0.9, 1.0)])
    return tube(line, [0.003, 0.0055, 0.0065, 0.0060, 0.003], 10)


def fork(length: float, tines: int = 4, handle: Material | None = None) -> Model:
    """A fork with curved tines."""
    head = length * 0.36
    stem = _handle(length - head, 0.020)
    root, wide = -head * 0.42, 0.0125
    palm: Stations = (
        (root, wide, 0.004, 0.0018),
        (root * 0.6, wide * 0.96, 0.003, 0.002),
        (root * 0.25, wide * 0.55, 0.004, 0.0026),
    )
    prongs = []
    for y in np.linspace(-wide * 0.84, wide * 0.84, tines):
        line = np.array(
            [
                (root + 0.004, y, 0.0038),
                (-head * 0.6, y, 0.0048),
                (-head * 0.85, y * 0.97, 0.0085),
                (-head, y * 0.95, 0.0125),
            ]
        )
        prongs.append(tube(line, [0.0017, 0.0015, 0.0012, 0.0005], 6))
    if handle is None:
        return (Part(merge([_leaf((*palm, *stem)), *prongs]), _STEEL),)
    return Part(merge([_leaf((*palm, stem[0], stem[1])), *prongs]), _STEEL), Part(_thick_handle(stem), handle)


def table_knife(length: float, handle: Material | None = None) -> Model:
    """A table knife lying on its side."""
    blade = length * 0.52
    edge: Stations = (
        (-blade, 0.0008, 0.004, 0.0006),
        (-blade * 0.97, 0.0055, 0.004, 0.0012),
        (-blade * 0.85, 0.0095, 0.004, 0.0016),
        (-blade * 0.4, 0.0100, 0.004, 0.0020),
        (-blade * 0.06, 0.0082, 0.004, 0.0026),
        (0.0, 0.0050, 0.004, 0.006),
    )
    grip: Stations = (
        (0.002, 0.0055, 0.004, 0.007),
        (length * 0.2, 0.0068, 0.004, 0.008),
        (length * 0.46, 0.0082, 0.004, 0.0075),
        (length * 0.48, 0.003, 0.004, 0.003),
    )
    if handle is None:
        return (Part(_leaf((*edge, *grip)), _STEEL),)
    return Part(_leaf(edge), _STEEL), Part(_leaf(grip), handle)


def kitchen_knife(length: float, width: float, handle: Material) -> Model:
    """A cook's knife: a broad blade with a straight back, riveted handle."""
    blade = length * 0.62
    x = -blade * np.array([1.0, 0.96, 0.85, 0.6, 0.3, 0.04, 0.0])
    half = width / 2 * np.array([0.03, 0.26, 0.62, 0.93, 1.0, 1.0, 0.96])
    mesh = _leaf(tuple((float(a), float(b), 0.008, 0.0022) for a, b in zip(x, half, strict=True)))
    shifted: Floats = mesh.vertices.copy()
    # The back of the blade stays straight; the edge curves up to the point.
    shifted[:, 1] += np.interp(mesh.vertices[:, 0], x, width / 2 - half)
    body = Mesh(shifted, mesh.triangles, mesh.normals, mesh.uvs)
    grip: Stations = (
        (-0.004, 0.0095, 0.008, 0.014),
        (length * 0.06, 0.0115, 0.008, 0.016),
        (length * 0.2, 0.0105, 0.008, 0.016),
        (length * 0.34, 0.0135, 0.008, 0.015),
        (length * 0.38, 0.006, 0.008, 0.006),
    )
    rivets = [
        tube([(x_at, width * 0.22, 0.0005), (x_at, width * 0.22, 0.0163)], 0.0028, 8)
        for x_at in (length * 0.07, length * 0.17, length * 0.27)
    ]
    return Part(merge([body, *rivets]), _STEEL), Part(moved(_leaf(grip), y=width * 0.22), handle)


def black_handle() -> Material:
    """Riveted black plastic."""
    return materials.paint("#1a1a1c", 0.5)
