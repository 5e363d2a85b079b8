"""From arrays of numbers to textures."""

import numpy as np
from numpy.typing import NDArray

from tools.household.model import Texture


def base_color(rgb: NDArray[np.floating], width_m: float, height_m: float) -> Texture:
    """A texture from sRGB values (H, W, 3) in 0–1, clipped to that range."""
    return Texture(np.rint(np.clip(rgb, 0.0, 1.0) * 255.0).astype(np.uint8), width_m, height_m)


def normals(relief_m: NDArray[np.floating], width_m: float, height_m: float) -> Texture:
    """A tangent-space normal map of a repeating relief (H, W) in metres.

    Green points to the top of the image, as glTF 2.0 (section 3.9.3, normal textures) demands.
    """
    rows, columns = relief_m.shape
    slope_u = (np.roll(relief_m, -1, 1) - np.roll(relief_m, 1, 1)) / (2.0 * width_m / columns)
    slope_down = (np.roll(relief_m, -1, 0) - np.roll(relief_m, 1, 0)) / (2.0 * height_m / rows)
    normal = np.stack([-slope_u, slope_down, np.ones_like(relief_m)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return Texture(np.rint((normal * 0.5 + 0.5) * 255.0).astype(np.uint8), width_m, height_m)
