"""Pictures in sensor_msgs Image and CompressedImage messages, as arrays.

Encodings of raw pictures: sensor_msgs/image_encodings.hpp. Depth: REP-118. Formats of compressed ones: the comments of
sensor_msgs/msg/CompressedImage.msg, and compressed_image_transport and compressed_depth_image_transport of
https://github.com/ros-perception/image_transport_plugins.
"""

import io
import struct
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Picture
from sensor_msgs.msg import CompressedImage

_LAYOUTS = {
    "rgb8": ("u1", 3),
    "bgr8": ("u1", 3),
    "rgba8": ("u1", 4),
    "bgra8": ("u1", 4),
    "mono8": ("u1", 1),
    "8UC1": ("u1", 1),
    "mono16": ("u2", 1),
    "16UC1": ("u2", 1),
    "32FC1": ("f4", 1),
}
_RED_GREEN_BLUE = {"rgb8": (0, 1, 2), "rgba8": (0, 1, 2), "bgr8": (2, 1, 0), "bgra8": (2, 1, 0), "mono8": (0, 0, 0)}
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
# compressed_depth_image_transport/compression_common.hpp, ConfigHeader: a format, and two quantisation parameters.
DEPTH_HEADER = struct.Struct("<iff")


def rgb(message: Any) -> npt.NDArray[np.uint8]:
    """Return a colour picture, uint8 (H, W, 3): rgb8, bgr8, rgba8, bgra8, mono8, or a compressed JPEG or PNG.

    A raw rgb8 picture without padding shares the message's memory; anything else is copied once.
    Raises ValueError when the message is malformed or of another encoding.
    """
    if isinstance(message, CompressedImage):
        return _compressed_rgb(message)
    pixels = _pixels(message, tuple(_RED_GREEN_BLUE))
    if message.encoding == "rgb8":
        return np.ascontiguousarray(pixels)
    picture = np.empty((*pixels.shape[:2], 3), np.uint8)
    # A channel at a time is several times as fast as pixels[..., ::-1] or pixels[..., :3].
    for to, source in enumerate(_RED_GREEN_BLUE[message.encoding]):
        picture[..., to] = pixels[..., source]
    return picture


def depth_m(message: Any) -> npt.NDArray[np.float32]:
    """Return planar depth in metres, float32 (H, W): 32FC1, 16UC1 (millimetres, 0 is invalid), or compressedDepth PNG.

    NaN is invalid, +inf too far, -inf too near (REP-118). A compressed picture does not tell too far from invalid: both
    are NaN. A raw 32FC1 picture without padding shares the message's memory; anything else is copied once.
    Raises ValueError when the message is malformed or of another encoding.
    """
    if isinstance(message, CompressedImage):
        return _compressed_depth_m(message)
    pixels = _pixels(message, ("32FC1", "16UC1"))[..., 0]
    return np.ascontiguousarray(pixels, np.float32) if message.encoding == "32FC1" else _millimetres(pixels)


def labels(message: Any, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Return a picture of numbers, (H, W) of an unsigned type: mono8, 8UC1, mono16, 16UC1, or a compressed PNG.

    Raises ValueError when the message is malformed, of another encoding, or has a number that the type cannot hold.
    """
    if isinstance(message, CompressedImage):
        numbers = _png(bytes(message.data), 0)
    else:
        numbers = _pixels(message, ("mono8", "8UC1", "mono16", "16UC1"))[..., 0]
    if numbers.max() > np.iinfo(dtype).max:
        raise ValueError(f"it holds the number {numbers.max()}, and the largest here is {np.iinfo(dtype).max}")
    return np.ascontiguousarray(numbers, dtype)


def _pixels(message: Any, accepted: tuple[str, ...]) -> npt.NDArray[Any]:
    """Return a view (H, W, channels) of a raw picture, in the byte order that it was sent in."""
    if message.encoding not in accepted:
        raise ValueError(f"its encoding is '{message.encoding}'; those understood here: {', '.join(accepted)}")
    item, channels = _LAYOUTS[message.encoding]
    dtype = np.dtype(item).newbyteorder(">" if message.is_bigendian else "<")
    height, width, step = message.height, message.width, message.step
    if not (height and width):
        raise ValueError(f"it is empty: {width} x {height} pixels")
    row = width * channels * dtype.itemsize
    if step < row:
        raise ValueError(f"its step is {step} bytes, and a row of {width} pixels of {message.encoding} needs {row}")
    if len(message.data) != step * height:
        raise ValueError(f"it has {len(message.data)} bytes, and {height} rows of {step} bytes make {step * height}")
    strides = (step, channels * dtype.itemsize, dtype.itemsize)
    return np.ndarray((height, width, channels), dtype, buffer=message.data, strides=strides)


def _millimetres(pixels: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    depth_m: npt.NDArray[np.float32] = np.divide(pixels, np.float32(1000), dtype=np.float32)
    depth_m[pixels == 0] = np.nan
    return depth_m


def _compressed_rgb(message: Any) -> npt.NDArray[np.uint8]:
    picture = _open(bytes(message.data), ("JPEG", "PNG"))
    if picture.mode.startswith(("I", "F")):
        raise ValueError(f"it is no colour picture: its pixels are numbers of the kind '{picture.mode}'")
    colours = np.array(picture.convert("RGB"))
    # The transport's own encoder hands blue first to a codec that expects blue first. One that hands it red first, and
    # says so, has swapped them in the file: that is how the transport's decoder reads it, too.
    return np.ascontiguousarray(colours[..., ::-1]) if "compressed rgb" in message.format else colours


def _compressed_depth_m(message: Any) -> npt.NDArray[np.float32]:
    encoding = message.format.partition(";")[0].strip()
    if encoding not in ("16UC1", "32FC1"):
        raise ValueError(f"its format is '{message.format}'; understood here: '16UC1; …' and '32FC1; …', with PNG")
    if "rvl" in message.format:
        raise ValueError(
            f"its format is '{message.format}', and of compressedDepth only PNG is read here: set the parameter "
            "compressedDepth.format of the node that publishes it to png"
        )
    data = bytes(message.data)
    bare = data.startswith(_PNG_SIGNATURE)
    numbers = _png(data, 0 if bare else DEPTH_HEADER.size)
    if encoding == "16UC1":
        return _millimetres(numbers)
    if bare:
        raise ValueError("it lacks the header of compressedDepth, which says how its numbers become metres")
    # Inverse depth, quantised (codec.cpp of compressed_depth_image_transport): number = a / depth + b, 0 is invalid.
    _, a, b = DEPTH_HEADER.unpack_from(data)
    if not (0 < a < np.inf and -np.inf < b < 1):
        raise ValueError(f"the parameters in its header, {a} and {b}, make no depth")
    depth_m = np.full(numbers.shape, np.nan, np.float32)
    return np.divide(np.float32(a), numbers - np.float32(b), out=depth_m, where=numbers != 0)


def _png(data: bytes, start: int) -> npt.NDArray[Any]:
    """Return a grey PNG's numbers, uint8 or uint16 (H, W)."""
    picture = _open(data[start:], ("PNG",))
    if picture.mode not in ("L", "I;16", "I"):
        raise ValueError(f"its pixels are of the kind '{picture.mode}', not single numbers of 8 or 16 bits")
    return np.array(picture)


def _open(data: bytes, formats: tuple[str, ...]) -> Picture.Image:
    try:
        picture = Picture.open(io.BytesIO(data), formats=formats)
        picture.load()
    except (OSError, SyntaxError, ValueError, Picture.DecompressionBombError) as error:
        raise ValueError(f"its {len(data)} bytes are no {' or '.join(formats)} picture ({error})") from error
    return picture
