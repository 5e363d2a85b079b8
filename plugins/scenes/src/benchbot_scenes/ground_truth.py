"""Ground truth: the object map of a scene, from its own vertices."""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry

BACKGROUND = "background"

SYNONYMS = {
    "television": "tv",
    "tvmonitor": "tv",
    "tv monitor": "tv",
    "computer monitor": "tv",
    "coffee table": "table",
    "dining table": "table",
    "kitchen table": "table",
    "desk": "table",
    "stool": "chair",
    "sofa": "couch",
    "diningtable": "dining table",
    "pottedplant": "potted plant",
    "plant": "potted plant",
    "cellphone": "cell phone",
    "mobile phone": "cell phone",
    "mobilephone": "cell phone",
    "wineglass": "wine glass",
    "none": BACKGROUND,
    "bg": BACKGROUND,
    "__background__": BACKGROUND,
}
"""Other names of classes, as BenchBot 2's ground truths give them."""


def ground_truth(geometry: SceneGeometry, environment: Mapping[str, Any]) -> dict[str, Any]:
    """The ground truth of an environment, in the form of BenchBot 2's: every object that has a class.

    `environment` is its declaration, which the document repeats; its `object_labels` are the classes. An object's
    `centroid` and `extent` (metres, map frame) are those of the axis-aligned box of its vertices; objects of other
    classes are left out.
    """
    classes = [str(label) for label in environment["object_labels"]]
    return {
        "environment": dict(environment),
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {
            "objects": mapped_objects(geometry, classes),
            "class_list": [*classes, BACKGROUND],
            "synonyms": {name: meant for name, meant in SYNONYMS.items() if _final(meant) in {*classes, BACKGROUND}},
        },
    }


def mapped_objects(geometry: SceneGeometry, classes: Collection[str]) -> list[dict[str, Any]]:
    """Every object of one of the classes as a ground truth has it: class, name, box and whether it is a group."""
    boxes = object_boxes(geometry)
    objects = []
    seen = set()
    for instance in geometry.instances:
        if instance.class_name in classes and instance.name in boxes and instance.name not in seen:
            seen.add(instance.name)
            low, high = boxes[instance.name]
            objects.append(
                {
                    "class": instance.class_name,
                    "ID_name": instance.name,
                    "centroid": _rounded((low + high) / 2),
                    "extent": _rounded(high - low),
                    "isgroup": instance.is_group,
                }
            )
    return objects


def object_boxes(geometry: SceneGeometry) -> dict[str, tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]]:
    """The axis-aligned box (low, high; metres, map frame) of every object that has triangles, by name."""
    names = {instance.index: instance.name for instance in geometry.instances}
    count = max(names, default=0) + 1
    low, high = np.full((count, 3), np.inf, np.float32), np.full((count, 3), -np.inf, np.float32)
    corners = geometry.vertices[geometry.triangles]
    np.minimum.at(low, geometry.triangle_instance, corners.min(axis=1))
    np.maximum.at(high, geometry.triangle_instance, corners.max(axis=1))
    boxes: dict[str, tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]] = {}
    for index, name in names.items():
        if np.isfinite(low[index]).all():
            before = boxes.get(name, (np.full(3, np.inf), np.full(3, -np.inf)))
            boxes[name] = (np.minimum(before[0], low[index]), np.maximum(before[1], high[index]))
    return boxes


def _final(name: str) -> str:
    while name in SYNONYMS:
        name = SYNONYMS[name]
    return name


def _rounded(values: npt.NDArray[np.float64]) -> list[float]:
    return [round(float(value), 6) for value in values]
