"""Doors and windows: which model fills an opening, and how it sits in its wall."""

import hashlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_scenes.building import window_offset_m
from benchbot_scenes.catalogue import AssetModel, Catalogue
from benchbot_scenes.floor_plan import Passage
from benchbot_scenes.placing import Matrix, moved

_KINDS = {
    ("door", True): "interior door",
    ("door", False): "door",
    ("window", True): "window",
    ("window", False): "window",
}
_GOOD_ENOUGH = 0.08
_INTO_WALL_M = 0.001
_HINGE_SIDE_M = 0.08
_DOOR_FRAME_M, _WINDOW_FRAME_M = 0.10, 0.08
LEAF = "leaf"
"""The name of a door model's node that turns."""


@dataclass(frozen=True)
class Fitting:
    """A model in an opening: `matrix` (4, 4) takes its frame to the map, `open_deg` turns its leaf about its hinge."""

    name: str
    model: AssetModel
    matrix: Matrix
    open_deg: float


def fitting(passage: Passage, catalogue: Catalogue) -> Fitting | None:
    """The model that fills an opening; None in a passage, or where the pack has none of the kind."""
    opening = passage.opening
    if opening.model is not None:
        model = catalogue.model(opening.model)
    elif opening.kind == "passage":
        return None
    else:
        chosen = _choice(passage, catalogue)
        if chosen is None:
            return None
        model = chosen
    height = opening.top_m - opening.bottom_m
    # The frame's depth is the model's, or the wall's where that is thinner.
    depth = min(1.0, passage.depth_m / model.size_m[0]) if opening.kind == "window" else 1.0
    width = (opening.width_m + 2 * _INTO_WALL_M) / model.size_m[1]
    mirror = -1.0 if opening.open_deg < 0 else 1.0
    scale = np.diag([depth, mirror * width, (height + _INTO_WALL_M) / model.size_m[2], 1.0])
    scale = scale @ np.diag([*model.scale, 1.0])
    is_window = opening.kind == "window"
    # A door's frame is flush with the near face, so that its leaf can swing into the room.
    behind = window_offset_m(passage.depth_m, _WINDOW_FRAME_M) if is_window else min(_DOOR_FRAME_M, passage.depth_m) / 2
    x, y = passage.middle + passage.through * behind
    turn = np.eye(4)
    turn[:2, 0], turn[:2, 1] = -passage.through, _left(-passage.through)
    matrix = moved((float(x), float(y), opening.bottom_m)) @ turn @ scale
    return Fitting(opening.name, model, matrix, abs(opening.open_deg))


def opened(open_deg: float, leaf: npt.NDArray[np.float64]) -> Matrix:
    """The turn of a leaf with these vertices (N, 3), in its model's frame, about the edge at -y of its face to +x."""
    hinge_y = float(leaf[:, 1].min())
    # Handles stand out further than the face does, but not at the hinge.
    hinge_x = float(leaf[leaf[:, 1] < hinge_y + _HINGE_SIDE_M, 0].max())
    angle = np.radians(-open_deg)
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return moved((hinge_x, hinge_y, 0.0)) @ turn @ moved((-hinge_x, -hinge_y, 0.0))


def _left(vector: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    return np.array([-vector[1], vector[0]])


def _choice(passage: Passage, catalogue: Catalogue) -> AssetModel | None:
    """Of the models that need hardly more stretching than the best, always the same one for an opening of this size."""
    opening = passage.opening
    models = [m for m in catalogue.of_kind(_KINDS[opening.kind, passage.far is not None]) if m.placement == "opening"]
    if not models:
        return None

    def stretching(model: AssetModel) -> float:
        across = opening.width_m / model.size_m[1]
        upward = (opening.top_m - opening.bottom_m) / model.size_m[2]
        return abs(float(np.log(across))) + abs(float(np.log(upward)))

    best = min(map(stretching, models))
    close = [model for model in models if stretching(model) <= best + _GOOD_ENOUGH]
    key = f"{opening.kind} {opening.width_m:g} {opening.top_m - opening.bottom_m:g}"
    return close[int.from_bytes(hashlib.sha256(key.encode()).digest()[:8], "big") % len(close)]
