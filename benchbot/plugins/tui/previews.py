"""Small pictures of environments and robots, from above, beside the lists to choose from."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from PIL import Image, ImageChops, ImageDraw, ImageOps

from benchbot.core.declarations.catalog import Declaration
from benchbot.plugins.drawing.map_model import MapPath
from benchbot.plugins.drawing.palette import DARK, ROBOT, between
from benchbot.plugins.drawing.scene_maps import map_of_environment
from benchbot.plugins.tui.choices import field_of_view_deg
from benchbot.plugins.tui.map_canvas import RunMap, paint

# About as many pixels as there are cells for it, so that lines stay visible.
WIDE_PX, HIGH_PX = 120, 80
BORDER_PX = 3
ROBOT_PX = 160


def preview(declaration: Declaration) -> Image.Image | None:
    """Return the picture of an environment or a robot, None where nothing is known to draw."""
    if declaration.kind == "environments":
        return environment(declaration)
    return robot(declaration.data) if declaration.kind == "robots" else None


def environment(declaration: Declaration) -> Image.Image | None:
    """Return the floor with walls and furniture, the trajectory and the start; RGB."""
    scene = map_of_environment(declaration)
    start = scene.start_xyyaw
    if start is None and scene.occupancy is None and not scene.planned:
        return None
    path = MapPath((start[:2], *scene.planned) if start else ())
    run_map = RunMap(replace(scene, planned=(), path=path, robot_xyyaw=start))
    picture = Image.fromarray(paint(run_map.scene, run_map.transform(WIDE_PX, HIGH_PX), dark=True))
    # Without most of the borders that have nothing of the map on them.
    drawn = ImageChops.difference(picture, Image.new("RGB", picture.size, DARK.paper)).getbbox()
    return ImageOps.expand(picture.crop(drawn), BORDER_PX, DARK.paper)


def robot(data: Mapping[str, Any]) -> Image.Image | None:
    """Return a robot of 2 × 2 m from above, looking up: its disc, and what its camera sees; RGB."""
    radius_m = (data.get("footprint") or {}).get("radius_m")
    if radius_m is None:
        return None
    side = ROBOT_PX
    scale, middle = side / 2.0, side / 2

    def disc(radius: float) -> tuple[float, float, float, float]:
        return middle - radius, middle - radius, middle + radius, middle + radius

    picture = Image.new("RGB", (side, side), DARK.floor)
    pen = ImageDraw.Draw(picture)
    angle = field_of_view_deg(data.get("camera") or {})
    if angle is not None:
        fill = between(DARK.floor, DARK.path, 0.3)
        pen.pieslice(disc(side * 0.48), -90 - angle / 2, -90 + angle / 2, fill=fill)
    for metres in (0.5, 1.0):
        pen.ellipse(disc(metres * scale), outline=DARK.planned)
    tip = radius_m * scale
    pen.ellipse(disc(tip), fill=DARK.wall)
    corners = [
        (middle + tip * math.cos(math.radians(turn)), middle - tip * math.sin(math.radians(turn)))
        for turn in (90, 215, 325)
    ]
    pen.polygon(corners, fill=ROBOT)
    return picture
