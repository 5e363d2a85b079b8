"""What a result on a ROS 2 robot depends on: distribution, middleware, network, packages, subscriptions and clocks."""

import json
import os
import re
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, distributions, version
from pathlib import Path
from typing import Any

from benchbot_robot_ros2.ros import Graph
from benchbot_robot_ros2.streams import Stream

_VERSION = re.compile(r"<version>\s*([^<\s]+)\s*</version>")
_ON_PYPI = re.compile(r"ros-([a-z]+)-rclpy")
# Packages of no Python module, on which every message depends.
_BELOW = ("rcl", "rmw", "fastrtps", "fastcdr", "cyclonedds", "zenoh")


def provenance(declaration: Mapping[str, Any], graph: Graph, streams: Iterable[Stream]) -> dict[str, Any]:
    """Return it as plain data; `graph` is the one that the robot is in.

    `streams` are those that the driver has had, open or not. Of each topic `clocks` has the median of receive time
    minus stamp, and the width of the middle 90 % of them, in seconds.
    """
    from rclpy.utilities import get_rmw_implementation_identifier

    known = {stream.topic.ros_topic: stream for stream in streams}
    return {
        "distribution": distribution(),
        "middleware": get_rmw_implementation_identifier(),
        "domain": int(os.environ.get("ROS_DOMAIN_ID") or 0) if graph.domain is None else graph.domain,
        "discovery_range": discovery_range(),
        "packages": dict(packages()),
        "declaration_sha256": sha256(json.dumps(declaration, sort_keys=True).encode()).hexdigest(),
        "subscriptions": {topic: stream.quality() for topic, stream in known.items()},
        "clocks": {topic: offset for topic, stream in known.items() if (offset := stream.clock_offset())},
    }


def discovery_range() -> str:
    """Return how far nodes of this process look for others, as ROS_AUTOMATIC_DISCOVERY_RANGE says it."""
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return "LOCALHOST"
    return (os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE") or "SUBNET").upper()


@cache
def distribution() -> str:
    """Return the distribution of ROS 2, such as jazzy: the one that was sourced, or the one from PyPI."""
    names = (one.name for one in distributions() if one.name)
    found = (match[1] for name in names if (match := _ON_PYPI.fullmatch(name)))
    return os.environ.get("ROS_DISTRO") or next(found, "unknown")


@cache
def packages() -> Mapping[str, str]:
    """Return the versions of the ROS 2 packages that this process has imported, and of those below them, by name."""
    found: dict[str, str] = {}
    for prefix in os.environ.get("AMENT_PREFIX_PATH", sys.prefix).split(os.pathsep):
        for manifest in sorted(Path(prefix, "share").glob("*/package.xml")):
            name = manifest.parent.name
            if name not in found and (name in sys.modules or name.startswith(_BELOW)):
                found[name] = _version(manifest)
    return dict(sorted(found.items()))


def _version(manifest: Path) -> str:
    try:  # what came from PyPI has a version of its own
        return version("ros-" + manifest.parent.name.replace("_", "-"))
    except PackageNotFoundError:
        said = _VERSION.search(manifest.read_text("utf-8", errors="replace"))
        return said[1] if said else "unknown"
