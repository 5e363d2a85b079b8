"""Small pictures of environments and robots, from above, for who chooses one."""

import io
import math
from collections.abc import Mapping
from typing import Any

from PIL import Image, ImageDraw

from benchbot.core.declarations.catalog import Declaration
from benchbot.core.platform import Scene
from benchbot.plugins.drawing.floors import floor_of
from benchbot.plugins.tui.facts import field_of_view_deg

PAPER, INK, WAY, START = (24, 28, 34), (196, 202, 210), (86, 156, 214), (230, 150, 40)
WIDE_PX, HIGH_PX = 240, 160
MARGIN_M = 0.3


def preview(declaration: Declaration) -> Image.Image | None:
    """Return the picture of an environment or a robot, None where nothing is known to draw."""
    if declaration.kind == "environments":
        return environment(declaration)
    return robot(declaration.data) if declaration.kind == "robots" else None


def environment(declaration: Declaration) -> Image.Image | None:
    """Return the floor with walls and furniture, the trajectory and the start; RGB."""
    scene = Scene(declaration.data, declaration.path.parent)
    floor = floor_of(declaration)
    way = [pose.translation_xyz[:2] for pose in scene.trajectory]
    start = scene.start_pose.translation_xyz[:2] if "start_pose" in declaration.data else None
    points = [*way, *([start] if start else []), *([floor.low, floor.high] if floor else [])]
    if not points:
        return None
    low = [min(point[axis] for point in points) - MARGIN_M for axis in (0, 1)]
    high = [max(point[axis] for point in points) + MARGIN_M for axis in (0, 1)]
    scale = min(WIDE_PX / (high[0] - low[0]), HIGH_PX / (high[1] - low[1]))
    picture = Image.new(
        "RGB", (max(1, round((high[0] - low[0]) * scale)), max(1, round((high[1] - low[1]) * scale))), PAPER
    )

    def at(point: Any) -> tuple[float, float]:
        return (point[0] - low[0]) * scale, (high[1] - point[1]) * scale

    if floor is not None:
        with Image.open(io.BytesIO(floor.picture)) as opened:
            stands = opened.convert("RGBA").getchannel("A").point(lambda value: 255 if value else 0)
        left, top = at((floor.low[0], floor.high[1]))
        right, bottom = at((floor.high[0], floor.low[1]))
        # Thin walls must not vanish where the picture is smaller than the map.
        stands = stands.resize((max(1, round(right - left)), max(1, round(bottom - top))), Image.Resampling.BOX)
        stands = stands.point(lambda value: 255 if value > 50 else value * 4)
        picture.paste(INK, (round(left), round(top)), stands)
    pen = ImageDraw.Draw(picture)
    if start and way:
        pen.line([at(start), *map(at, way)], fill=WAY, width=2)
    if start:
        x, y = at(start)
        pen.ellipse((x - 5, y - 5, x + 5, y + 5), fill=START)
    return picture


def robot(data: Mapping[str, Any]) -> Image.Image | None:
    """Return a robot of 2 × 2 m from above, looking up: its disc, and what its camera sees; RGB."""
    radius_m = (data.get("footprint") or {}).get("radius_m")
    if radius_m is None:
        return None
    side = HIGH_PX
    scale, middle = side / 2.0, side / 2
    picture = Image.new("RGB", (side, side), PAPER)
    pen = ImageDraw.Draw(picture)
    angle = field_of_view_deg(data.get("camera") or {})
    if angle is not None:
        reach = side * 0.48
        box = (middle - reach, middle - reach, middle + reach, middle + reach)
        pen.pieslice(box, -90 - angle / 2, -90 + angle / 2, fill=(44, 66, 92))
    for metres in (0.5, 1.0):
        pen.ellipse([middle - metres * scale] * 2 + [middle + metres * scale] * 2, outline=(60, 66, 74))
    pen.ellipse([middle - radius_m * scale] * 2 + [middle + radius_m * scale] * 2, fill=INK)
    tip = radius_m * scale
    corners = [
        (middle + tip * math.cos(math.radians(turn)), middle - tip * math.sin(math.radians(turn)))
        for turn in (90, 215, 325)
    ]
    pen.polygon(corners, fill=START)
    return picture
