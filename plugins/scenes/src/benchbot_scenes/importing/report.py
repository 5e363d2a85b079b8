"""The report of an import: one HTML file that needs no other, no network and no script."""

import base64
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from PIL import Image

from benchbot_scenes.importing import pictures
from benchbot_scenes.importing.environment import Imported

MOST_NAMES = 200
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
        above=_inline(pictures.from_above(imported)),
        map=_inline(pictures.map_picture(imported)),
        guesses=[(_WHAT[key], value, imported.reasons.get(key, "as told")) for key, value in values.items()],
        notes=imported.notes,
        classes=sorted(classes.items()),
        unseen=imported.unseen,
        others=_shortened(others),
        hidden=_shortened(imported.guesses.hidden or ()),
    )


def _shortened(names: Sequence[str]) -> list[str]:
    left = [*names[:MOST_NAMES]]
    return left if len(names) <= MOST_NAMES else [*left, f"and {len(names) - MOST_NAMES} more"]


def _inline(picture: Image.Image) -> str:
    return f"data:image/jpeg;base64,{base64.b64encode(pictures.jpeg(picture)).decode()}"
