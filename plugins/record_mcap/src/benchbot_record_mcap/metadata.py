"""The `metadata.yaml` of a rosbag2 directory, version 9, the one of ROS 2 Jazzy.

Source: `rosbag2_storage/include/rosbag2_storage/bag_metadata.hpp` and `yaml.hpp` of https://github.com/ros2/rosbag2,
branch jazzy.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

VERSION = 9


@dataclass
class Topic:
    """A topic of a bag: its type, the type's hash (RIHS01, REP-2016) and how many messages it has so far."""

    name: str
    type: str
    type_hash: str
    messages: int = 0


def document(file_name: str, topics: Iterable[Topic], start_ns: int, end_ns: int) -> dict[str, Any]:
    """Return the metadata of a bag of one MCAP file, without the outermost key."""
    topics = list(topics)
    count = sum(topic.messages for topic in topics)

    def times() -> dict[str, Any]:
        return {
            "starting_time": {"nanoseconds_since_epoch": start_ns},
            "duration": {"nanoseconds": end_ns - start_ns},
            "message_count": count,
        }

    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **times(),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type,
                    "serialization_format": "cdr",
                    # Players then offer rosbag2's default: reliable, volatile, the last ten.
                    "offered_qos_profiles": [],
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.messages,
            }
            for topic in topics
        ],
        # The MCAP file compresses its own chunks; these would say that the whole file or each message is compressed.
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [{"path": file_name, **times()}],
        "custom_data": None,
        "ros_distro": "jazzy",
    }
