"""What stands on the floor of a scene: its occupancy map in the format of ROS's map_server.

Format: https://docs.nav2.org/tutorials/docs/navigation2_with_slam.html and https://wiki.ros.org/map_server#Map_format
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import Image

from benchbot.core.declarations.catalog import Declaration

MOST_PIXELS = 1 << 24


@dataclass(frozen=True)
class Occupancy:
    """Where something stands: bool (rows, columns), row 0 where y is greatest; as small as all of it allows."""

    occupied: NDArray[np.bool_]
    resolution_m: float
    """The side of a cell."""
    low: tuple[float, float]
    """The corner of least x and y, metres in the map frame."""

    @property
    def high(self) -> tuple[float, float]:
        """The corner of greatest x and y."""
        rows, columns = self.occupied.shape
        return self.low[0] + columns * self.resolution_m, self.low[1] + rows * self.resolution_m


def occupancy_of(environment: Declaration | None) -> Occupancy | None:
    """Return the occupancy of an environment, None when no map of it can be read.

    The map is what `occupancy_map` names, or `maps/NAME_VARIANT.yaml` beside the folder of the declaration.
    """
    if environment is None:
        return None
    beside = f"../maps/{environment.name.replace(':', '_')}.yaml"
    path = environment.path.parent / str(environment.data.get("occupancy_map", beside))
    try:
        about: dict[str, Any] = yaml.safe_load(path.read_text("utf-8"))
        with Image.open(path.parent / str(about["image"])) as image:
            if image.width * image.height > MOST_PIXELS:
                return None
            grey = np.asarray(image.convert("L"), float) / 255.0
        return _occupancy(about, grey)
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError, Image.DecompressionBombError):
        return None


def _occupancy(about: dict[str, Any], grey: NDArray[np.float64]) -> Occupancy | None:
    """Return the part of a map where something stands; None without any, and of a map that is turned."""
    resolution_m = float(about["resolution"])
    x, y, yaw_rad = (float(value) for value in about["origin"])
    occupied = (grey if about.get("negate") else 1.0 - grey) > float(about["occupied_thresh"])
    rows, columns = (np.flatnonzero(occupied.any(axis)) for axis in (1, 0))
    if not len(rows) or yaw_rad or not (math.isfinite(x + y) and 0 < resolution_m < 1e3):
        return None
    (top, bottom), (left, right) = (int(rows[0]), int(rows[-1]) + 1), (int(columns[0]), int(columns[-1]) + 1)
    low = x + left * resolution_m, y + (len(grey) - bottom) * resolution_m
    return Occupancy(occupied[top:bottom, left:right], resolution_m, low)
