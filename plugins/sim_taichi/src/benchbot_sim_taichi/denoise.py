"""Intel Open Image Denoise, where `pyoidn` is installed (the extra `denoise`)."""

import importlib
from importlib.util import find_spec

from benchbot_scenes.scene import FloatArray


def is_installed() -> bool:
    """Return whether the library that denoises pictures is installed."""
    return find_spec("pyoidn") is not None


def denoise(radiance: FloatArray, albedo: FloatArray, normal: FloatArray) -> FloatArray:
    """Return radiance (H, W, 3) without noise, guided by the reflectance and the normals (H, W, 3) of the surfaces."""
    denoised: FloatArray = importlib.import_module("pyoidn").denoise(radiance, albedo, normal, hdr=True, quality="high")
    return denoised
