"""The placement of models: transforms in the map frame, and the replacement of a model by one of another pack."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from benchbot_scenes.catalogue import AssetModel, Catalogue
from benchbot_scenes.layout import Placement

Matrix = npt.NDArray[np.float64]

_STRETCHES = (1.3, 1.6)
"""Limits of a stand-in's stretch along one axis against another: the preferred one, and the greatest."""

_TURN_PAYS = 1.6


@dataclass(frozen=True)
class Placed:
    """A model in the scene: `matrix` (4, 4) takes its own frame to the map; `class_name` None for what no map names."""

    name: str
    model: AssetModel
    matrix: Matrix
    class_name: str | None
    is_group: bool


def place(placement: Placement, model: AssetModel, other: Catalogue | None = None) -> Placed:
    """Put a model where the placement says; `other` is a pack whose models stand in for objects that have a class.

    A stand-in fills the box that the model would have filled, so that the ground truth stays true; it is turned by 90°
    where it then fits clearly better. One is chosen that need not be stretched much along one axis against another;
    where all would have to be stretched by more than 1.6, the model stays.
    """
    class_name = model.class_name if placement.class_name is None else placement.class_name or None
    is_group = model.is_group if placement.is_group is None else placement.is_group
    wanted = np.array(model.size_m if placement.size_m is None else placement.size_m)
    taken, fit = model, fill(wanted, model)
    if other is not None and class_name is not None:
        for most in _STRETCHES:
            stand_in = other.stand_in(class_name, placement.id, model.placement, partial(_fits, wanted, most))
            if stand_in is not None:
                taken, fit = stand_in, fit_into(wanted, stand_in)
                break
    matrix = moved(placement.position) @ turned(placement.yaw_deg) @ fit
    return Placed(placement.id, taken, matrix, class_name, is_group)


def fill(wanted_m: npt.NDArray[np.float64], model: AssetModel) -> Matrix:
    """The scaling of a model's file that gives it this box, whatever it does to its proportions."""
    return np.diag([*(wanted_m / np.array(model.size_m) * np.array(model.scale)), 1.0])


def fit_into(wanted_m: npt.NDArray[np.float64], model: AssetModel) -> Matrix:
    """The transform with which a model fills the box of this size that stands on the origin (see `place`)."""
    scale, turn = _scale_and_turn(wanted_m, model)
    return np.diag([*scale, 1.0]) @ turned(turn)


def _fits(wanted_m: npt.NDArray[np.float64], most: float, model: AssetModel) -> bool:
    return _stretch(_scale_and_turn(wanted_m, model)[0]) <= most


def _scale_and_turn(wanted_m: npt.NDArray[np.float64], model: AssetModel) -> tuple[npt.NDArray[np.float64], float]:
    size = np.array(model.size_m)
    across = size[[1, 0, 2]]
    if model.placement != "wall" and _stretch(wanted_m / size) > _TURN_PAYS * _stretch(wanted_m / across):
        return wanted_m / across, 90.0
    return wanted_m / size, 0.0


def moved(offset_m: tuple[float, float, float]) -> Matrix:
    """A translation."""
    matrix = np.eye(4)
    matrix[:3, 3] = offset_m
    return matrix


def turned(angle_deg: float) -> Matrix:
    """A turn about z, counter-clockwise; quarter turns are exact."""
    quarter, rest = divmod(angle_deg, 90.0)
    cosine, sine = (
        [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][int(quarter) % 4]
        if rest == 0.0
        else (np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg)))
    )
    matrix = np.eye(4)
    matrix[:2, :2] = [[cosine, -sine], [sine, cosine]]
    return matrix


def _stretch(scale: npt.NDArray[np.float64]) -> float:
    return float(scale.max() / scale.min())
