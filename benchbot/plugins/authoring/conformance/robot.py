"""The conformance of robots."""

import math
from functools import partial

from benchbot.core.channels import ACTIONS
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Finding, Level
from benchbot.core.motion import MotionConfig
from benchbot.plugins.authoring.conformance.bench import Declared, Found, find
from benchbot.plugins.authoring.conformance.properties import Wrong, look
from benchbot.plugins.authoring.conformance.task import describes_itself

PICTURES = ("image_rgb", "image_depth", "image_segment")


def check_robot(robot: Declared, *, catalog: Catalog | None = None) -> list[Finding]:
    """Return what is right and wrong with a robot's declaration. What it does is for `check_simulator` to see.

    `catalog` is what is installed, where that has been read already.
    """
    found: list[Found] = []

    def declared() -> str:
        found.append(find("robots", robot, catalog))
        return str(found[0].data["name"])

    findings = [look("declaration", declared)]
    if found:
        properties = (
            ("description", describes_itself),
            ("type", _runs_on_something),
            ("frames", _has_its_frames),
            ("connections", _connects_the_right_way),
            ("camera models", _has_camera_models),
            ("limits", _has_sensible_limits),
        )
        findings += [look(subject, partial(holds, found[0])) for subject, holds in properties]
    return findings


def _runs_on_something(found: Found) -> str:
    from benchbot.core.plugin_manager import load

    kind = found.data["type"]
    known = {*load().pool("simulators"), *load().pool("robot_drivers")}
    if kind not in known:
        raise Wrong(
            f"Neither a simulator nor a driver is called '{kind}'.",
            f"Write the type of one that is installed: {', '.join(sorted(known)) or 'none is'}.",
        )
    return str(kind)


def _has_its_frames(found: Found) -> str:
    frame = found.data["robot_frame"]
    if frame not in found.data["poses"]:
        raise Wrong(f"poses lacks the robot's own frame '{frame}'.", f"Add '{frame}' to poses.")
    if "initial_pose" not in found.data["poses"]:
        raise Wrong(
            "poses lacks 'initial_pose'.", "Add 'initial_pose' to poses: solutions of v2 use it.", Level.WARNING
        )
    return ", ".join(found.data["poses"])


def _connects_the_right_way(found: Found) -> str:
    for name, connection in found.data["connections"].items():
        way = connection["connection"]
        if (way == "api_to_ros") != (name in ACTIONS):
            raise Wrong(
                f"'{name}' is connected by '{way}'.",
                "Actions are api_to_ros, observations ros_to_api or roscache_to_api.",
            )
    offered = [name for name in ACTIONS if name in found.data["connections"]]
    if not offered:
        raise Wrong("It offers no action.", f"Connect some of {', '.join(ACTIONS)}.", Level.WARNING)
    return f"{len(found.data['connections'])}, with {', '.join(offered)}"


def _has_camera_models(found: Found) -> str:
    connections = found.data["connections"]
    lacking = [name for name in PICTURES if name in connections and f"{name}_info" not in connections]
    if lacking:
        raise Wrong(
            f"{', '.join(lacking)} comes without a camera model.",
            f"Connect {', '.join(f'{name}_info' for name in lacking)}: pictures are of little use without.",
            Level.WARNING,
        )
    return "one for each picture"


def _has_sensible_limits(found: Found) -> str:
    config = MotionConfig.from_robot(found.data, "ground_truth")
    low, high = config.linear_limits_mps
    if not low <= 0 < high:
        raise Wrong(f"linear_mps is [{low:g}, {high:g}].", "Write [backwards, forwards] in m/s, such as [-0.6, 1.5].")
    if config.angular_limit_radps > 2 * math.pi:
        raise Wrong(
            f"angular_radps is {config.angular_limit_radps:g}, more than a turn per second.",
            "Write radians per second, not degrees.",
            Level.WARNING,
        )
    return f"{low:g} to {high:g} m/s, {config.angular_limit_radps:g} rad/s"
