"""Occupancy maps as ROS's map_server reads them: a picture, and a YAML file that says where it lies and what is free.

Format: https://wiki.ros.org/map_server#Map_format and Nav2's map_server (https://docs.nav2.org, "Map Server / Saver").
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yaml
from numpy.typing import NDArray

from benchbot.core import documents
from benchbot.core.errors import BenchbotError

T = TypeVar("T", bound=np.generic)
Cells = NDArray[np.bool_]
REAL = documents.REAL
MOST_PIXELS = 1 << 24
KEYS = ("image", "resolution", "origin", "occupied_thresh", "free_thresh")
MODES = ("trinary", "scale")
_WRITE_IT_ANEW = "Write it anew (ros2 run nav2_map_server map_saver_cli), or correct the file."


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """What stands where: bool (rows, columns), row 0 on top of the picture; what is neither is unknown.

    `origin_xyyaw` is the pose of the picture's lower left corner in the map frame, in metres and radians.
    """

    occupied: Cells
    free: Cells
    resolution_m: float
    origin_xyyaw: tuple[float, float, float]

    def corners(self) -> NDArray[np.float64]:
        """Return the corners (4, 2) of the picture in the map frame."""
        rows, columns = self.occupied.shape
        width, height = columns * self.resolution_m, rows * self.resolution_m
        x, y, yaw = self.origin_xyyaw
        turned = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        inside = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
        placed: NDArray[np.float64] = inside @ turned.T + (x, y)
        return placed

    def at(self, cells: NDArray[T], points_xy: NDArray[np.float64]) -> NDArray[T]:
        """Return the values of `cells`, such as `free`, at points (N, 2) in the map frame; zero beyond it."""
        rows, columns = cells.shape
        x, y, yaw = self.origin_xyyaw
        turned = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        across, up = np.floor((points_xy - (x, y)) @ turned / self.resolution_m).astype(np.int64).T
        inside = (across >= 0) & (across < columns) & (up >= 0) & (up < rows)
        found = np.zeros(len(points_xy), cells.dtype)
        found[inside] = cells[rows - 1 - up[inside], across[inside]]
        return found

    def place(self, x_m: float, y_m: float) -> str:
        """Return what the map has at a point: `free`, `occupied`, `unknown` or `outside` of it."""
        point = np.array([[x_m, y_m]])
        if not self.at(np.ones_like(self.free), point)[0]:
            return "outside"
        return "free" if self.at(self.free, point)[0] else "occupied" if self.at(self.occupied, point)[0] else "unknown"


def map_file(environment: Mapping[str, Any], folder: Path) -> Path:
    """Return where the map of an environment is, or would be; `folder` is that of its declaration.

    Of a real one `map_path` names it. `occupancy_map` does of any, and else it is `maps/NAME_VARIANT.yaml` beside the
    folder.
    """
    named = environment.get("occupancy_map", f"../maps/{environment['name']}_{environment['variant']}.yaml")
    if environment.get("type") == REAL:
        named = environment.get("map_path", named)
    return folder / str(named)


def read(path: Path) -> OccupancyMap:
    """Return the map in a YAML file; raises BenchbotError, saying what of it cannot be used."""
    try:
        about = yaml.safe_load(path.read_text("utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise _refused(path, f"It is no YAML file that can be read: {_first_line(error)}.", _WRITE_IT_ANEW) from error
    if not isinstance(about, Mapping) or (lacking := [key for key in KEYS if key not in about]):
        what = "It is no mapping" if not isinstance(about, Mapping) else f"It lacks {', '.join(lacking)}"
        fix = "Name the YAML file of a map of ROS's map_server: the one beside its picture."
        raise _refused(path, f"{what}.", fix)
    mode = str(about.get("mode", "trinary"))
    if mode not in MODES:
        why = f"Its mode is '{mode}'; understood here: {', '.join(MODES)}, in which dark is occupied and light is free."
        raise _refused(path, why, "Save it in the mode trinary: map_saver_cli --mode trinary")
    numbers = _numbers(path, about)
    darkness = _darkness(path.parent / str(about["image"]), path)
    darkness = 1.0 - darkness if about.get("negate") else darkness
    occupied, free = darkness > numbers["occupied_thresh"], darkness < numbers["free_thresh"]
    x, y, yaw = (float(value) for value in about["origin"])
    return OccupancyMap(occupied, free, numbers["resolution"], (x, y, yaw))


def _numbers(path: Path, about: Mapping[str, Any]) -> dict[str, float]:
    try:
        numbers = {key: float(about[key]) for key in ("resolution", "occupied_thresh", "free_thresh")}
        origin = [float(value) for value in about["origin"]]
    except (TypeError, ValueError) as error:
        raise _refused(path, f"A number in it is none: {_first_line(error)}.", _WRITE_IT_ANEW) from error
    if not 0 < numbers["resolution"] < 1e3:
        why = f"Its resolution is {numbers['resolution']:g}: it is the side of a pixel in metres, such as 0.05."
        raise _refused(path, why, "Correct the resolution.")
    if len(origin) != 3 or not all(map(math.isfinite, origin)):
        why = "Its origin is the pose of the lower left corner: x and y in metres, and yaw in radians."
        raise _refused(path, why, "Write it like this: origin: [-3.2, -1.5, 0.0]")
    if not 0 <= numbers["free_thresh"] < numbers["occupied_thresh"] <= 1:
        why = f"It is free below {numbers['free_thresh']:g} and occupied above {numbers['occupied_thresh']:g}."
        raise _refused(path, why, "0 <= free_thresh < occupied_thresh <= 1, such as 0.196 and 0.65.")
    return numbers


def _darkness(image: Path, path: Path) -> NDArray[np.float64]:
    """Return how dark the pixels of a picture are, from 0 for white to 1 for black."""
    from PIL import Image

    fix = "Correct 'image', or save the picture as an 8-bit grey PGM or PNG."
    try:
        with Image.open(image) as picture:
            if picture.width * picture.height > MOST_PIXELS:
                raise _refused(path, f"{image.name} has more than {MOST_PIXELS} pixels.", "Crop it.")
            if picture.mode not in ("1", "L", "P", "RGB") or "transparency" in picture.info:
                why = (
                    f"{image.name} is of the kind '{picture.mode}': only 8 bits, without transparency, are understood."
                )
                raise _refused(path, why, fix)
            light: NDArray[np.float64] = np.asarray(picture.convert("RGB"), float).mean(2) / 255.0
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise _refused(path, f"Its picture {image} cannot be read: {_first_line(error)}.", fix) from error
    return 1.0 - light


def _refused(path: Path, why: str, fix: str) -> BenchbotError:
    return BenchbotError(f"The map {path} cannot be used.", why, fix)


def _first_line(error: Exception) -> str:
    said = getattr(error, "strerror", None) or str(error)
    return str(said).partition("\n")[0].rstrip(".")
