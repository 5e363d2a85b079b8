"""Scenes of boxes for the tests: quick to make, and easy to say what is seen and reached in them."""

from dataclasses import replace

import numpy as np

from benchbot_scenes.generator.proxy import Shape, geometry, prism
from benchbot_scenes.scene import Material, SceneGeometry

Corner = tuple[float, float, float]


def box(name: str, low: Corner, high: Corner, class_name: str | None = None) -> Shape:
    (x0, y0, z0), (x1, y1, z1) = low, high
    return Shape(name, class_name, prism([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], z0, z1))


def room(width_m: float = 4.0, depth_m: float = 3.0, height_m: float = 2.5) -> list[Shape]:
    """Floor and four walls, the inside from (0, 0) to (width, depth)."""
    w, d, h = width_m, depth_m, height_m
    return [
        box("floor", (-0.2, -0.2, -0.1), (w + 0.2, d + 0.2, 0.0)),
        box("west", (-0.2, -0.2, 0.0), (0.0, d + 0.2, h)),
        box("east", (w, -0.2, 0.0), (w + 0.2, d + 0.2, h)),
        box("south", (-0.2, -0.2, 0.0), (w + 0.2, 0.0, h)),
        box("north", (-0.2, d, 0.0), (w + 0.2, d + 0.2, h)),
    ]


def scene(*shapes: Shape, glass: str | None = None) -> SceneGeometry:
    """Shapes as a scene; `glass` names one that light passes."""
    made = geometry(shapes)
    index = next((found.index for found in made.instances if found.name == glass), -1)
    is_glass = (made.triangle_instance == index).astype(np.int32)
    return replace(made, materials=(Material(), Material(transmission=1.0)), triangle_material=is_glass)
