"""Turn one hue of a baked picture into another: infinigen likes purple chairs more than people do."""

import numpy as np
from PIL import Image

from plugins.assets_household.bake.parts import Picture

_REACH_DEG = 45.0


def recoloured(picture: Picture, hue_deg: float, to_deg: float, saturation: float = 1.0) -> Picture:
    """The picture (H, W, 3) with hues near `hue_deg` turned to `to_deg`, their saturation scaled; others stay."""
    pixels = np.array(Image.fromarray(picture).convert("HSV"))
    hues = pixels[..., 0].astype(np.float64) * 360 / 255
    away = (hues - hue_deg + 180) % 360 - 180
    near = np.abs(away) < _REACH_DEG
    pixels[..., 0] = np.where(near, np.round((away + to_deg) % 360 * 255 / 360), pixels[..., 0])
    pixels[..., 1] = np.where(near, np.clip(pixels[..., 1] * saturation, 0, 255), pixels[..., 1])
    return np.array(Image.fromarray(pixels, "HSV").convert("RGB"))
