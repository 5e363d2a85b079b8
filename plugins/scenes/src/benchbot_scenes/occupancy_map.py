"""Occupancy maps as ROS's map_server reads them: a PNG picture, 8-bit grey, and a YAML file that says where it lies.

Format: https://wiki.ros.org/map_server#Map_format and Nav2's map_server (docs.nav2.org, "Map Server / Saver"). Pixel
values as ROS's map_saver writes them: 254 free, 0 occupied, 205 unknown.
"""

import io
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy import ndimage

from benchbot.plugin import write_atomically
from benchbot_scenes.free_space import FreeSpace

FREE, OCCUPIED, UNKNOWN = 254, 0, 205
# By (255 - value) / 255, unknown is 0.19608: just not free, as in the files of ROS's map_saver.
OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.196


def occupancy(space: FreeSpace, start: tuple[float, float]) -> npt.NDArray[np.uint8]:
    """The picture: row 0 is the largest y, column 0 the smallest x, one pixel per cell.

    Free is what is connected to `start`, occupied what blocks beside it, unknown everything else (outside, and the
    insides of walls and furniture).
    """
    free = space.has_floor & ~space.is_blocked
    labels, _ = ndimage.label(free)
    column, row = space.cell(*start)
    inside = 0 <= column < space.shape[0] and 0 <= row < space.shape[1]
    label = int(labels[column, row]) if inside else 0
    reached = labels == label if label else space.region(start, space.cell_m)
    seen = ndimage.binary_dilation(reached, np.ones((3, 3), bool), iterations=2)
    picture = np.full(space.shape, UNKNOWN, np.uint8)
    picture[space.is_blocked & seen] = OCCUPIED
    picture[reached] = FREE
    return np.ascontiguousarray(picture.T[::-1])


def write_occupancy_map(stem: Path, space: FreeSpace, start: tuple[float, float]) -> tuple[Path, Path]:
    """Write STEM.png and STEM.yaml; return both. `origin` is the lower left corner of the map (x, y, yaw)."""
    image, description = stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.yaml")
    picture = io.BytesIO()
    Image.fromarray(occupancy(space, start)).save(picture, "PNG", optimize=True)
    write_atomically(image, picture.getvalue())
    x, y = (round(corner, 6) + 0.0 for corner in space.low_m)
    text = (
        f"image: {image.name}\nmode: trinary\nresolution: {space.cell_m:g}\norigin: [{x:g}, {y:g}, 0.0]\nnegate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESH}\nfree_thresh: {FREE_THRESH}\n"
    )
    write_atomically(description, text.encode())
    return image, description
