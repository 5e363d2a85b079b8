"""Observations read back from a recording, as they were."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchbot_record_mcap import exact
from benchbot_record_mcap.bag import TYPES
from benchbot_record_mcap.topics import COLOUR, DEPTH, EXACT, SEGMENTATION

PICTURES = {
    f"{COLOUR}/image_raw": ("image_rgb", None),
    f"{DEPTH}/image_raw": ("image_depth", None),
    f"{SEGMENTATION}/class": ("image_segment", "class_segment_img"),
    f"{SEGMENTATION}/instance": ("image_segment", "instance_segment_img"),
}
_CLASS_IDS = f"{SEGMENTATION}/class_ids"


def decoded(schema: Any, message: Any) -> Any:
    """Return a message of ROS 2 as an MCAP reader gives it."""
    return TYPES.deserialize_cdr(message.data, schema.name)


def observations(messages: Iterable[tuple[Any, Any, Any]]) -> dict[str, Any]:
    """Return the observations in the messages of one stamp: (schema, channel, message) as an MCAP reader gives them.

    Raises KeyError or ValueError when a picture is malformed.
    """
    pictures: dict[str, Any] = {}
    order: list[str] = []
    values: dict[str, Any] = {}
    for schema, channel, message in messages:
        topic = channel.topic
        if topic == EXACT:
            order, values = exact.decode(decoded(schema, message))
        elif topic == _CLASS_IDS:
            pictures.setdefault("image_segment", {})["class_ids"] = exact.identifiers(decoded(schema, message))
        elif topic in PICTURES:
            name, part = PICTURES[topic]
            pixels = np.array(exact.pixels(decoded(schema, message)))
            if part is None:
                pictures[name] = pixels
            else:
                pictures.setdefault(name, {})[part] = pixels
    seen = {**values, **pictures}
    return {channel: seen[channel] for channel in order}


def read(folder: Path) -> Iterator[Mapping[str, Any]]:
    """Yield the observations of each step of a recording, in order; none of what cannot be read."""
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    for file in sorted(folder.glob("*.mcap")):
        try:
            with file.open("rb") as stream:
                reader = make_reader(stream)
                stamps = [message.log_time for _, _, message in reader.iter_messages([EXACT])]
                for stamp in stamps:
                    yield observations(reader.iter_messages(start_time=stamp, end_time=stamp + 1))
        except (McapError, OSError):
            return
