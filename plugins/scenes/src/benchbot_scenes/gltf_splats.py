"""Splats in glTF files: the extension KHR_gaussian_splatting (Khronos, release candidate of July 2026).

A primitive of points has a position, a quaternion, standard deviations, an opacity and spherical harmonics as
attributes. Harmonics above degree 1 are not read.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.gltf_file import GltfFile, UnsupportedError
from benchbot_scenes.splats import Splats, colors_of_harmonics, transformed

EXTENSION = "KHR_gaussian_splatting"
POINTS = 0
_UNIFORM = 1e-4


def is_splats(primitive: dict[str, Any]) -> bool:
    """True for a primitive of splats."""
    return EXTENSION in (primitive.get("extensions") or {})


def read(file: GltfFile, primitive: dict[str, Any], matrix: npt.NDArray[np.float64]) -> Splats:
    """The splats of a primitive, moved by its node's world `matrix` (4, 4).

    Raises UnsupportedError for other kernels and colours, and where the matrix stretches or mirrors them; ValueError
    for numbers that are none.
    """
    asked = primitive["extensions"][EXTENSION]
    for key, value in (("kernel", "ellipse"), ("colorSpace", "srgb_rec709_display"), ("projection", "perspective")):
        if asked.get(key, value) != value:
            raise UnsupportedError(f"Its splats have the {key} '{asked[key]}'; only '{value}' is drawn.")
    if primitive.get("mode") != POINTS:
        raise ValueError("splats have to be a primitive of points")
    scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
    turn = matrix[:3, :3] / scale if scale > 0 else np.zeros((3, 3))
    if not np.allclose(turn @ turn.T, np.eye(3), atol=_UNIFORM):
        raise UnsupportedError("A node stretches or mirrors its splats; it may turn, shift and scale them evenly.")
    return transformed(_splats(file, primitive["attributes"]), turn, scale=scale, offset=matrix[:3, 3])


def _splats(file: GltfFile, attributes: dict[str, int]) -> Splats:
    def values(name: str, components: int) -> npt.NDArray[np.float32]:
        found = file.accessor(attributes[name if name == "POSITION" else f"{EXTENSION}:{name}"]).astype(np.float32)
        if found.shape != (count, components) or not np.isfinite(found).all():
            raise ValueError(f"splats have no {components} finite numbers each as their {name}")
        return found

    count = int(file.document["accessors"][attributes["POSITION"]]["count"])
    rotations = values("ROTATION", 4)
    length = np.linalg.norm(rotations, axis=1, keepdims=True)
    scales, opacities = values("SCALE", 3), values("OPACITY", 1)[:, 0]
    if not length.all() or (scales < 0).any() or (opacities < 0).any() or (opacities > 1).any():
        raise ValueError("splats have a rotation, a scale or an opacity that is none")
    linear = np.zeros((count, 3, 3), np.float32)
    if f"{EXTENSION}:SH_DEGREE_1_COEF_0" in attributes:
        linear = np.stack([values(f"SH_DEGREE_1_COEF_{order}", 3) for order in range(3)], axis=1)
    colors, slopes = colors_of_harmonics(values("SH_DEGREE_0_COEF_0", 3), linear)
    return Splats(values("POSITION", 3), rotations / length, scales, opacities, colors, slopes)
