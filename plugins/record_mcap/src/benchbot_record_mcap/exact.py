"""Exact values of observations as JSON: a message of ROS rounds a laser's ranges, and has no word for some of the rest.

An array is `{"array": [dtype, shape, base64 of its bytes]}`; all else is what JSON has, with NaN and Infinity.
"""

import json
from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchbot_record_mcap import messages

IMAGES = ("image_rgb", "image_depth", "image_segment")
"""Channels whose pictures are exact as they are; of `image_segment` the identifiers are, too."""


def encode(observations: Mapping[str, Any]) -> Any:
    """Return the exact values of all channels but pictures."""
    small = {channel: _plain(value) for channel, value in observations.items() if channel not in IMAGES}
    return messages.text({"order": list(observations), "values": small})


def decode(message: Any) -> tuple[list[str], dict[str, Any]]:
    """Return the names of all channels, in order, and the values of those that are not pictures.

    Raises ValueError, KeyError or TypeError for a message that is none of these.
    """
    document = json.loads(message.data)
    return list(document["order"]), {channel: _value(value) for channel, value in document["values"].items()}


def pixels(image: Any) -> Any:
    """Return the pixels of a sensor_msgs/msg/Image that `messages.image` made; raises KeyError or ValueError."""
    dtype, channels = messages.ENCODINGS[image.encoding]
    shape = (image.height, image.width) + ((channels,) if channels > 1 else ())
    return np.frombuffer(bytes(image.data), np.dtype(dtype).newbyteorder("<")).reshape(shape)


def identifiers(message: Any) -> dict[str, int]:
    """Return the class identifiers in a message of `image_segment`."""
    return dict(json.loads(message.data))


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.ndarray):
        return {"array": [value.dtype.str, list(value.shape), b64encode(np.ascontiguousarray(value).data).decode()]}
    return value.item() if isinstance(value, np.generic) else value


def _value(value: Any) -> Any:
    if isinstance(value, list):
        return [_value(item) for item in value]
    if not isinstance(value, dict):
        return value
    if value.keys() == {"array"}:
        dtype, shape, data = value["array"]
        return np.frombuffer(b64decode(data), dtype).reshape(shape)
    return {key: _value(item) for key, item in value.items()}
