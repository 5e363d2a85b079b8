"""Intel Open Image Denoise, where `pyoidn` is installed (the extra `denoise`)."""

import importlib
from importlib.util import find_spec

import numpy as np

from benchbot_scenes.scene import FloatArray
from benchbot_sim_taichi.colorimetry import LUMINANCE

MOST_SHADE = 0.02


def is_installed() -> bool:
    """Return whether the library that denoises pictures is installed."""
    return find_spec("pyoidn") is not None


def denoise(radiance: FloatArray, albedo: FloatArray, normal: FloatArray) -> FloatArray:
    """Return radiance (H, W, 3) without noise, guided by the reflectance and the normals (H, W, 3) of the surfaces.

    Of each colour there is as much as in the samples, each pixel weighed by its brightness: what the network adds and
    takes away, by half a per cent and unlike for red and green, would be a shade on everything.
    """
    denoised: FloatArray = importlib.import_module("pyoidn").denoise(radiance, albedo, normal, hdr=True, quality="high")
    brightness = np.maximum(denoised @ LUMINANCE, 1e-6)[..., None]
    sampled, left = ((image / brightness).mean(axis=(0, 1), dtype=np.float64) for image in (radiance, denoised))
    # Of few samples a single one may weigh more than that.
    ratio = np.clip(sampled / np.maximum(left, 1e-6), 1.0 - MOST_SHADE, 1.0 + MOST_SHADE)
    denoised *= ratio.astype(denoised.dtype)
    return denoised
