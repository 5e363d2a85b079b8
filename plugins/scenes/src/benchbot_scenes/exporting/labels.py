"""What an exported scene tells beyond its looks: names and classes, which are ground truth."""

from collections import Counter
from dataclasses import replace

import numpy as np

from benchbot_scenes.scene import Instance, SceneGeometry


def without_labels(geometry: SceneGeometry) -> SceneGeometry:
    """The scene with numbers for names, and without classes and groups.

    Objects are numbered by where they are: their order in a file tells what was placed together.
    """
    corners = geometry.vertices[geometry.triangles].min(axis=1)
    low = np.full((max(found.index for found in geometry.instances) + 1, 3), np.inf)
    np.minimum.at(low, geometry.triangle_instance, corners)
    order = sorted(geometry.instances, key=lambda found: tuple(low[found.index].tolist()))
    number = np.zeros(len(low), np.int32)
    for index, found in enumerate(order, start=1):
        number[found.index] = index
    materials = tuple(
        # Texels of painted triangles stand alone: writers know them by this word, and keep them as they are.
        replace(material, name=f"material_{index}{' painted' * material.name.endswith('painted')}")
        for index, material in enumerate(geometry.materials, start=1)
    )
    return replace(
        geometry,
        triangle_instance=number[geometry.triangle_instance],
        instances=tuple(Instance(index, f"object_{index}", None) for index in range(1, len(order) + 1)),
        materials=materials,
    )


def unique_names(geometry: SceneGeometry) -> dict[int, str]:
    """A name for each instance, by index: its own with what XML cannot hold as `_`, numbered where two are the same."""
    taken: Counter[str] = Counter()
    names: dict[int, str] = {}
    for found in geometry.instances:
        plain = "".join(letter if letter.isprintable() else "_" for letter in found.name) or "object"
        name = plain
        while name in taken:
            taken[plain] += 1
            name = f"{plain}_{taken[plain]}"
        taken[name] += 1
        names[found.index] = name
    return names
