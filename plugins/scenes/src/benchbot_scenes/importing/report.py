"""The report of an import with its pictures: one HTML file that needs no other, no network and no script."""

import base64
import io
import math
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from PIL import Image, ImageDraw

from benchbot_scenes.importing.environment import Imported
from benchbot_scenes.importing.planning import level_camera
from benchbot_scenes.occupancy_map import occupancy
from benchbot_scenes.top_down import top_down

MOST_NAMES = 200
MAP_PIXELS, ABOVE_PIXELS = 900, 1200
VIEW_WIDTH, VIEW_HEIGHT, VIEW_DEG = 640, 360, 90.0
VIEWS = 4
JPEG_QUALITY = 85
_NO_CLASS = ("none", "not known")
_PATH, _START = (29, 90, 143), (200, 60, 30)
_WHAT = {"units": "Unit", "up": "Up axis", "floor_z_m": "Floor in the file", "start_pose": "Start pose"}


def page(imported: Imported, source: str, views: Sequence[Image.Image]) -> str:
    """The report's HTML."""
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    classes: dict[str, list[str]] = defaultdict(list)
    for found in imported.geometry.instances:
        if found.class_name is not None:
            classes[found.class_name].append(f"{found.name} (several)" if found.is_group else found.name)
    others = [found.name for found in imported.geometry.instances if found.class_name is None]
    guesses = imported.guesses
    values = {
        "units": str(guesses.units),
        "up": str(guesses.up),
        "floor_z_m": f"{guesses.floor_z_m:g} m",
        "start_pose": ", ".join(f"{value:g}" for value in guesses.start_pose or ()),
    }
    return templates.get_template("report.html").render(
        name=imported.declaration["name"],
        source=source,
        triangles=f"{len(imported.geometry.triangles):,}",
        size=" x ".join(f"{side:.1f}" for side in imported.understood.size_m),
        free_area=f"{imported.room.area_m2:.1f}",
        poses=len(imported.declaration["trajectory_poses"]),
        objects=imported.ground_truth["ground_truth"]["objects"],
        views=[_inline(view) for view in views],
        above=_inline(_from_above(imported)),
        map=_inline(map_picture(imported)),
        guesses=[(_WHAT[key], value, imported.reasons.get(key, "as told")) for key, value in values.items()],
        notes=imported.notes,
        classes=sorted(classes.items()),
        unseen=imported.unseen,
        labels=_labels(imported),
        others=_shortened(others),
        hidden=_shortened(imported.guesses.hidden or ()),
    )


def _labels(imported: Imported) -> dict[str, Any] | None:
    """The format of the labels, and rows of label, number and class."""
    labelled = imported.understood.labelled
    if labelled is None:
        return None
    rows = [
        (label, labelled.counts[label], found or ("none" if label in labelled.known else "not known"))
        for label, found in labelled.classes.items()
    ]
    return {"format": labelled.format, "rows": sorted(rows, key=lambda row: (row[2] in _NO_CLASS, -row[1], row[0]))}


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
    draw.line([pixel(*place) for place in places], fill=_PATH, width=max(2, scale // 2), joint="curve")
    tip = (x + 0.35 * math.cos(heading), y + 0.35 * math.sin(heading))
    sides = [(x + 0.18 * math.cos(heading + turn), y + 0.18 * math.sin(heading + turn)) for turn in (2.4, -2.4)]
    draw.polygon([pixel(*place) for place in (tip, *sides)], fill=_START)
    return picture


def views(imported: Imported, cache_dir: Path | None = None) -> list[Image.Image]:
    """Render the robot's views at the start and at some poses of its path; none without benchbot-sim-taichi."""
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
    batch = renderer.render_batch(np.stack([level_camera(poses[number]) for number in shown]), camera)
    return [Image.fromarray(np.asarray(picture)) for picture in batch.rgb]


def _from_above(imported: Imported) -> Image.Image:
    """The scene without what is above 2 m."""
    picture = top_down(imported.geometry)
    picture.thumbnail((ABOVE_PIXELS, ABOVE_PIXELS))
    return picture


def _shortened(names: Sequence[str]) -> list[str]:
    left = [*names[:MOST_NAMES]]
    return left if len(names) <= MOST_NAMES else [*left, f"and {len(names) - MOST_NAMES} more"]


def _inline(picture: Image.Image) -> str:
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "JPEG", quality=JPEG_QUALITY)
    return f"data:image/jpeg;base64,{base64.b64encode(stream.getvalue()).decode()}"
