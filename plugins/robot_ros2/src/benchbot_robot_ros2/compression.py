"""Pictures as compressed messages, as image_transport's plug-ins publish them; `images` reads them."""

import io
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from sensor_msgs.msg import CompressedImage

from benchbot_robot_ros2.images import DEPTH_HEADER
from benchbot_robot_ros2.messages import set_stamp

JPEG_QUALITY = 95
"""The default of compressed_image_transport."""
_INVERSE_DEPTH = 0
_LARGEST = 2**16 - 1


def compress(channel: str, pixels: npt.NDArray[Any], *, stamp_ns: int, frame_id: str) -> Any:
    """Return colour (`image_rgb`) as JPEG, or depth (`image_depth`) as a PNG of inverse depth, quantised.

    Depth keeps 16 bits between the nearest and the farthest pixel of the picture: an error of at most half of
    depth² × (1 / nearest - 1 / farthest) / 65534. What is no number is 0, which says invalid.
    """
    if channel == "image_rgb":
        buffer = io.BytesIO()
        Image.fromarray(pixels).save(buffer, "JPEG", quality=JPEG_QUALITY)
        # The order of colours that JPEG's decoders expect, in the words of compressed_image_transport.
        message = CompressedImage(format="rgb8; jpeg compressed bgr8")
        message.data.frombytes(buffer.getvalue())
    else:
        message = CompressedImage(format="32FC1; compressedDepth png")
        message.data.frombytes(_compressed_depth(pixels))
    set_stamp(message, stamp_ns)
    message.header.frame_id = frame_id
    return message


def _compressed_depth(depth_m: npt.NDArray[np.float32]) -> bytes:
    known = np.isfinite(depth_m) & (depth_m > 0)
    nearest_m, farthest_m = (
        (float(np.min(depth_m[known])), float(np.max(depth_m[known]))) if known.any() else (1.0, 1.0)
    )
    # The farthest becomes 1, and what is nearer than a percent of it has room above.
    farthest_m = max(farthest_m, 1.01 * nearest_m)
    scale = np.float32((_LARGEST - 1) / (1 / nearest_m - 1 / farthest_m))
    offset = np.float32(1 - scale / farthest_m)
    numbers = np.zeros(depth_m.shape, np.uint16)
    inverse = float(scale) / depth_m[known].astype(np.float64) + float(offset)
    numbers[known] = np.clip(np.rint(inverse), 1, _LARGEST)
    buffer = io.BytesIO(DEPTH_HEADER.pack(_INVERSE_DEPTH, scale, offset))
    buffer.seek(0, io.SEEK_END)
    Image.fromarray(numbers).save(buffer, "PNG", compress_level=1)
    return buffer.getvalue()
