"""Names of one robot of several: topics and services in its namespace, remapped; frames with its prefix.

The rules for topics and services are those of ROS 2 (https://design.ros2.org/articles/topic_and_service_names.html,
https://design.ros2.org/articles/static_remapping.html).
"""

import re
from collections.abc import Mapping
from typing import Any

import msgspec

from benchbot.plugin import BenchbotError

KEYS = frozenset({"ros_topic", "ros_service", "ros_action", "initial_pose", "scene_node"})
"""The keys of a declaration that hold the name of a topic, a service, an action or a node."""

# What stands for the namespace in a declared `frame_prefix`.
_NAMESPACE = "{namespace}"
_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


class Names(msgspec.Struct, frozen=True):
    """The names of a robot of a fleet, as its declaration has them in `driver`."""

    robot: str
    namespace: str = ""
    frame_prefix: str = ""
    remap: dict[str, str] = {}

    def resolved(self, name: str) -> str:
        """Return the full name of a topic, service or node: a relative one is in the namespace; remapped at last.

        Raises BenchbotError for what is no name in ROS 2.
        """
        full = self._full(name)
        return next((self._full(to) for given, to in self.remap.items() if self._full(given) == full), full)

    def frame(self, name: str) -> str:
        """Return a frame's id in messages: with the prefix, unless the declared name begins with a slash."""
        return name.removeprefix("/") if name.startswith("/") else self.frame_prefix + name

    def in_all(self, settings: Any) -> Any:
        """Return settings, as plain data, with the full name under each of `KEYS`."""
        if isinstance(settings, Mapping):
            return {
                key: self.resolved(value) if key in KEYS and isinstance(value, str) else self.in_all(value)
                for key, value in settings.items()
            }
        return [self.in_all(value) for value in settings] if isinstance(settings, list | tuple) else settings

    def _full(self, name: str) -> str:
        full = name if name.startswith("/") else "/".join(("", *filter(None, (self.namespace.strip("/"), name))))
        if _NAME.fullmatch(full):
            return full
        raise BenchbotError(
            f"The robot '{self.robot}' cannot be reached: '{full}' is no name in ROS 2.",
            "A name is made of letters, digits and underscores, in levels between slashes; no level begins with a "
            "digit.",
            "Correct it in the robot's declaration, or the namespace: --robot NAME@robot_1",
        )


def prefix_in(namespace: str, declared: str) -> str:
    """Return what is put before frames; a prefix that is made of the namespace is none where there is none."""
    return "" if _NAMESPACE in declared and not namespace else declared.replace(_NAMESPACE, namespace)
