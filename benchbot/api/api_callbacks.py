"""Conversions that v2's client applied to observations. Ours arrive converted; solutions may still call these."""

import base64
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


def convert_to_rgb(data: Any) -> Any:
    """Return the H x W x 3 uint8 image of `{"encoding": "bgr8", "data": image}` as RGB.

    The image of another encoding is returned as it is, and so is anything that is not such a mapping: an RGB image.
    """
    if not isinstance(data, Mapping) or "data" not in data:
        return data
    image = data["data"]
    return np.ascontiguousarray(image[..., ::-1]) if data.get("encoding") == "bgr8" else image


def decode_color_image(data: Mapping[str, Any]) -> NDArray[np.uint8]:
    """Return the H x W x 3 uint8 RGB image in `{"data": base64 text of a PNG or JPEG file}`.

    Raises ValueError for what is no image.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(base64.b64decode(data["data"])), formats=("PNG", "JPEG")) as image:
            return np.array(image.convert("RGB"))
    except (UnidentifiedImageError, OSError) as error:
        raise ValueError(f"the data is not an image: {error}") from error
