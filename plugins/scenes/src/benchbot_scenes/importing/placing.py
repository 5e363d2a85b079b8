"""Moving a whole scene: turned upright, scaled to metres, set down on its floor."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.importing.model import UpAxis
from benchbot_scenes.scene import SceneGeometry


def turned(geometry: SceneGeometry, rotation: npt.NDArray[np.floating]) -> SceneGeometry:
    """The scene after a rotation (3, 3) about the origin."""
    return replace(
        geometry,
        vertices=(geometry.vertices @ rotation.T.astype(np.float32)).astype(np.float32),
        normals=(geometry.normals @ rotation.T.astype(np.float32)).astype(np.float32),
    )


def upright(geometry: SceneGeometry, unit_m: float, up: UpAxis) -> SceneGeometry:
    """The scene in metres with z up; y up turns as glTF's axes do: (x, y, z) becomes (x, -z, y)."""
    scaled = replace(geometry, vertices=(geometry.vertices.astype(np.float64) * unit_m).astype(np.float32))
    return scaled if up == "z" else turned(scaled, Y_UP_TO_Z_UP)


def shifted(geometry: SceneGeometry, by_m: tuple[float, float, float]) -> SceneGeometry:
    """The scene moved by a vector."""
    if by_m == (0.0, 0.0, 0.0):
        return geometry
    return replace(geometry, vertices=(geometry.vertices.astype(np.float64) + by_m).astype(np.float32))
