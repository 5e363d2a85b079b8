"""A scene as binary glTF 2.0, with what lets it be imported again just as it is."""

import yaml

from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.importing.guesses import SUFFIX
from benchbot_scenes.scene import SceneGeometry


def files(geometry: SceneGeometry, name: str) -> dict[str, bytes]:
    """NAME.glb, and beside it NAME.import.yaml, which leaves nothing to guess to `benchbot import-environment`."""
    known = {
        "units": "m",
        "up": "y",
        "floor_z_m": 0.0,
        "hidden": [],
        "classes": {found.name: None for found in geometry.instances if found.class_name is None},
    }
    text = yaml.safe_dump(known, sort_keys=False, allow_unicode=True)
    return {f"{name}.glb": to_glb(geometry), f"{name}{SUFFIX}": text.encode()}
