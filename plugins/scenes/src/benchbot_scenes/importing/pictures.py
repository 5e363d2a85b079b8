"""Pictures of an imported environment: its map with the trajectory, from above, and what the robot sees."""

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from benchbot_scenes.importing.environment import Imported
from benchbot_scenes.occupancy_map import occupancy
from benchbot_scenes.top_down import top_down

MAP_PIXELS, ABOVE_PIXELS = 900, 1200
VIEW_WIDTH, VIEW_HEIGHT, VIEW_DEG = 640, 360, 90.0
VIEWS = 4
EYE_M = 1.05
JPEG_QUALITY = 85
_WAY, _START = (29, 90, 143), (200, 60, 30)


def map_picture(imported: Imported) -> Image.Image:
    """The occupancy map, larger, with the trajectory and an arrow where it starts."""
    space, (x, y, heading) = imported.room.space, imported.room.start
    grey = Image.fromarray(occupancy(space, (x, y)))
    scale = max(1, min(8, MAP_PIXELS // max(grey.size)))
    picture = grey.resize((grey.width * scale, grey.height * scale), Image.Resampling.NEAREST).convert("RGB")
    draw = ImageDraw.Draw(picture)

    def pixel(px: float, py: float) -> tuple[float, float]:
        column, row = (px - space.low_m[0]) / space.cell_m, (py - space.low_m[1]) / space.cell_m
        return column * scale, (space.shape[1] - row) * scale

    places = [(x, y), *((pose[4], pose[5]) for pose in imported.declaration["trajectory_poses"])]
    draw.line([pixel(*place) for place in places], fill=_WAY, width=max(2, scale // 2), joint="curve")
    tip = (x + 0.35 * math.cos(heading), y + 0.35 * math.sin(heading))
    sides = [(x + 0.18 * math.cos(heading + turn), y + 0.18 * math.sin(heading + turn)) for turn in (2.4, -2.4)]
    draw.polygon([pixel(*place) for place in (tip, *sides)], fill=_START)
    return picture


def from_above(imported: Imported) -> Image.Image:
    """The scene without what is above 2 m."""
    picture = top_down(imported.geometry)
    picture.thumbnail((ABOVE_PIXELS, ABOVE_PIXELS))
    return picture


def views(imported: Imported, cache_dir: Path | None = None) -> list[Image.Image]:
    """What the robot sees at the start and at some poses of its way, ray-traced; none without benchbot-sim-taichi."""
    try:
        from benchbot_sim_taichi.lighting import Lighting
        from benchbot_sim_taichi.renderer import Intrinsics, Renderer
    except ImportError:
        return []
    lighting = Lighting.from_mapping(imported.declaration.get("lighting"))
    renderer = Renderer(imported.geometry, lighting, cache_dir=cache_dir)
    camera = Intrinsics.from_horizontal_fov(VIEW_WIDTH, VIEW_HEIGHT, VIEW_DEG)
    poses = [imported.declaration["start_pose"], *imported.declaration["trajectory_poses"]]
    shown = sorted({round(number * (len(poses) - 1) / VIEWS) for number in range(VIEWS)})
    batch = renderer.render_batch(np.stack([_eye(poses[number]) for number in shown]), camera)
    return [Image.fromarray(np.asarray(picture)) for picture in batch.rgb]


def jpeg(picture: Image.Image) -> bytes:
    """The picture as the bytes of a JPEG file."""
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "JPEG", quality=JPEG_QUALITY)
    return stream.getvalue()


def _eye(pose: Sequence[float]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """The optical frame (x right, y down, z forward) of a camera above a base pose [qw, qx, qy, qz, x, y, z]."""
    heading = 2 * math.atan2(pose[3], pose[0])
    cos, sin = math.cos(heading), math.sin(heading)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[sin, 0.0, cos], [-cos, 0.0, sin], [0.0, -1.0, 0.0]])
    matrix[:3, 3] = (pose[4], pose[5], pose[6] + EYE_M)
    return matrix
