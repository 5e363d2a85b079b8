"""The encodings of BenchBot v2: observations as jsonpickle text, everything else as JSON. Nothing is decoded here.

The form is that of jsonpickle with its numpy extension, as v2's robot controller wrote it: arrays of up to 16 elements
as nested lists, larger ones as base64 of their zlib-compressed bytes (https://jsonpickle.readthedocs.io).
"""

import base64
import json
import zlib
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from benchbot.core.errors import BenchbotError

MAX_LISTED_ELEMENTS = 16
TAG = "py/"
IMAGE_RGB_CALLBACK = "api_callbacks.convert_to_rgb"
"""The function of v2's client, by its own name, that turns `image_rgb` as it is sent into RGB."""


def observation(name: str, value: Any) -> bytes:
    """Return an observation as v2 sent it: colour images in the order B, G, R, angles of poses as a tuple.

    Raises BenchbotError for a name in it that v2's client would not take for data.
    """
    if name == "image_rgb":
        value = {"encoding": "bgr8", "data": value[..., ::-1]}
    elif name == "poses":
        value = {frame: _pose(record) for frame, record in value.items()}
    _refuse_tags(value)
    return json.dumps(_plain(value)).encode()


def document(value: Any) -> bytes:
    """Return plain data as JSON with sorted keys and a newline; raises BenchbotError for what is no plain data."""
    try:
        _refuse_tags(value)
        return msgspec.json.encode(value, enc_hook=_scalar, order="sorted") + b"\n"
    except (TypeError, ValueError, RecursionError) as error:
        raise BenchbotError(
            "The answer cannot be sent as JSON.",
            f"{error}.",
            "Use dicts, lists, strings, numbers, booleans and None.",
        ) from error


def _pose(record: dict[str, Any]) -> dict[str, Any]:
    angles = tuple(float(angle) for angle in record["rotation_rpy"])
    return {key: angles if key == "rotation_rpy" else value for key, value in record.items()}


def _plain(value: Any) -> Any:
    """Return a value as what `json` writes."""
    if isinstance(value, np.ndarray):
        return _array(value)
    if isinstance(value, np.generic):
        return {"py/object": f"numpy.{type(value).__name__}", "dtype": str(value.dtype), "value": value.item()}
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return {"py/tuple": [_plain(item) for item in value]}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value


def _array(array: NDArray[Any]) -> dict[str, Any]:
    name = str(array.dtype.newbyteorder("="))
    if array.size <= MAX_LISTED_ELEMENTS:
        listed = {"py/object": "numpy.ndarray", "dtype": name, "values": array.tolist()}
        return listed | ({"shape": array.shape} if array.size == 0 else {})
    elements = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    packed = {
        "py/object": "numpy.ndarray",
        "values": base64.b64encode(zlib.compress(elements.data)).decode(),
        "shape": array.shape,
        "dtype": name,
    }
    return packed | ({"byteorder": "<"} if array.itemsize > 1 else {})


def _refuse_tags(value: Any) -> None:
    """Raise BenchbotError for a key that has v2's client build an object: a name in a declaration is no code."""
    if isinstance(value, dict):
        for key, item in value.items():
            if isinstance(key, str) and key.startswith(TAG):
                raise BenchbotError(
                    f"The key '{key}' cannot be sent to BenchBot v2's client.",
                    "Its decoder takes a key that begins with 'py/' for an order to build a Python object.",
                    "Rename the key.",
                )
            _refuse_tags(item)
    elif isinstance(value, list | tuple):
        for item in value:
            _refuse_tags(item)


def _scalar(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"values of type {type(value).__name__} are not supported")
