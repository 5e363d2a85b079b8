"""The published figures of an environment: boxes of the objects, start pose and trajectory."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Box:
    """A published object: axis-aligned, in metres, in the map frame; `extent` is the full size.

    Models are placed to a tenth of a millimetre; `figures` are centroid and extent as they were published.
    """

    instance: str
    category: str
    centroid: tuple[float, float, float]
    extent: tuple[float, float, float]
    is_group: bool
    figures: tuple[list[float], list[float]]


@dataclass(frozen=True)
class Published:
    """An environment as published. Poses are [qw, qx, qy, qz, x, y, z] on the floor, turned about z only."""

    name: str
    variant: str
    start_pose: tuple[float, ...]
    trajectory_poses: tuple[tuple[float, ...], ...]
    objects: tuple[Box, ...]
    class_list: tuple[str, ...]
    synonyms: dict[str, str]

    def box(self, instance: str) -> Box:
        """The object of this name."""
        return next(box for box in self.objects if box.instance == instance)


def load_published(name: str, variant: str) -> Published:
    """Read published figures from the package."""
    text = files("benchbot_envs_bear").joinpath("published", f"{name}_{variant}.json").read_text(encoding="utf-8")
    data = json.loads(text)
    return Published(
        name,
        variant,
        _on_floor(data["start_pose_wxyz_xyz"]),
        tuple(_on_floor(pose) for pose in data["trajectory_poses_wxyz_xyz"]),
        tuple(_box(entry) for entry in data["objects"]),
        tuple(data["class_list"]),
        dict(data["synonyms"]),
    )


def _box(entry: dict[str, Any]) -> Box:
    figures = entry["centroid"], entry["extent"]
    (x, y, z), (width, depth, height) = ([round(number, 4) for number in numbers] for numbers in figures)
    return Box(entry["id"], entry["class"], (x, y, z), (width, depth, height), entry["isgroup"], figures)


def _on_floor(pose: list[float]) -> tuple[float, ...]:
    """Keep the heading and the place; the published tilt of the moving robot is within half a degree."""
    w, z = pose[0], pose[3]
    length = float(np.hypot(w, z))
    return (round(w / length, 6), 0.0, 0.0, round(z / length, 6), pose[4], pose[5], 0.0)
