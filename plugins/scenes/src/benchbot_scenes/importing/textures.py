"""Textures of imported scenes, decoded; one that cannot be is noted, and a plain colour stands for it."""

import io

import numpy as np
from PIL import Image, UnidentifiedImageError

from benchbot_scenes.scene import ImageArray


def decode(data: bytes | None, name: str, images: list[ImageArray], notes: list[str]) -> int | None:
    """Append a picture (H, W, 4) to `images` and return its number, None when there is no usable one."""
    if data is None:
        return None
    try:
        with Image.open(io.BytesIO(data)) as image:
            images.append(np.asarray(image.convert("RGBA")))
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError) as error:
        notes.append(f"The texture {name} is no usable picture ({error}); a plain colour stands for it.")
        return None
    return len(images) - 1
