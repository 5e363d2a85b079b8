"""Intel Open Image Denoise, where `pyoidn` is installed (the extra `denoise`)."""

import importlib
from importlib.util import find_spec

from benchbot_scenes.scene import FloatArray


def is_installed() -> bool:
    """Whether pictures can be denoised here."""
    return find_spec("pyoidn") is not None


def denoise(radiance: FloatArray, albedo: FloatArray, normal: FloatArray) -> FloatArray:
    """(H, W, 3) radiance without noise, led by the reflectance and the normals (H, W, 3) of what is seen."""
    denoised: FloatArray = importlib.import_module("pyoidn").denoise(radiance, albedo, normal, hdr=True, quality="high")
    return denoised
