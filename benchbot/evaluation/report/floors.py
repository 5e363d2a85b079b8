"""What stands on the floor of a scene: its occupancy map in the format of ROS's map_server, as a picture for a map.

Format: https://docs.nav2.org/tutorials/docs/navigation2_with_slam.html and https://wiki.ros.org/map_server#Map_format
"""

import base64
import io
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml
from PIL import Image

from benchbot.core.catalog import Declaration
from benchbot.evaluation.report.material import Document

MOST_PIXELS = 1 << 24
_INK = (128, 128, 122, 190)


@dataclass(frozen=True)
class Floor:
    """Where something stands: `picture` (a PNG) covers `low` to `high` in the map frame, metres, x right and y up."""

    low: tuple[float, float]
    high: tuple[float, float]
    picture: bytes

    @property
    def data_uri(self) -> str:
        """The picture as a page holds it."""
        return "data:image/png;base64," + base64.b64encode(self.picture).decode()


def floor_of(environment: Declaration | None) -> Floor | None:
    """Return the floor of an environment, None when no map of it can be read.

    The map is what `occupancy_map` names, or `maps/NAME_VARIANT.yaml` beside the folder of the declaration.
    """
    if environment is None:
        return None
    beside = f"../maps/{environment.name.replace(':', '_')}.yaml"
    path = environment.path.parent / str(environment.data.get("occupancy_map", beside))
    try:
        about: Document = yaml.safe_load(path.read_text("utf-8"))
        with Image.open(path.parent / str(about["image"])) as image:
            if image.width * image.height > MOST_PIXELS:
                return None
            grey = np.asarray(image.convert("L"), float) / 255.0
        return _floor(about, grey)
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError, Image.DecompressionBombError):
        return None


def _floor(about: Document, grey: Any) -> Floor | None:
    """Return the part of a map where something stands; None without any, and of a map that is turned."""
    resolution_m = float(about["resolution"])
    x, y, yaw_rad = (float(value) for value in about["origin"])
    occupied = (grey if about.get("negate") else 1.0 - grey) > float(about["occupied_thresh"])
    rows, columns = (np.flatnonzero(occupied.any(axis)) for axis in (1, 0))
    if not len(rows) or yaw_rad or not (math.isfinite(x + y) and 0 < resolution_m < 1e3):
        return None
    (top, bottom), (left, right) = (int(rows[0]), int(rows[-1]) + 1), (int(columns[0]), int(columns[-1]) + 1)
    shown = occupied[top:bottom, left:right]
    picture = Image.fromarray(shown.astype(np.uint8))
    picture.putpalette([0, 0, 0, 0, *_INK], "RGBA")
    buffer = io.BytesIO()
    picture.save(buffer, "PNG", optimize=True)
    height = len(grey)
    return Floor(
        low=(x + left * resolution_m, y + (height - bottom) * resolution_m),
        high=(x + right * resolution_m, y + (height - top) * resolution_m),
        picture=buffer.getvalue(),
    )
