"""Callbacks that turn a robot's messages into observations: a fixed registry, and plug-ins.

A robot's declaration names a callback by `callback_robot`; the default is the one with the channel's name. A
distribution adds one by an entry point of the group `benchbot.ros2_callbacks` to a `Callback` of the same name.
"""

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from benchbot.plugin import BenchbotError, PluginInfo, Segmentation, did_you_mean
from benchbot.plugin import installed_plugins as installed
from benchbot_robot_ros2 import clouds, images, sensors

GROUP = "benchbot.ros2_callbacks"


@dataclass(frozen=True)
class Callback:
    """Turns messages of one instant into an observation.

    `types` says which ROS types each part of the observation may have; an observation from a single topic has one part,
    named by the empty string. `decode` is given the message of every part, and raises ValueError with half a sentence
    ("its encoding is …") when one is malformed.
    """

    name: str
    types: Mapping[str, frozenset[str]]
    decode: Callable[[Mapping[str, Any]], Any]


def find(name: str) -> Callback:
    """Return a callback by name; raises BenchbotError when there is none, or two, or a plug-in's cannot be loaded."""
    plugins = installed(GROUP)
    found = [plugin for plugin in plugins if plugin.name == name]
    if len(found) + (name in _BUILT_IN) > 1:
        owners = ["benchbot-robot-ros2"] * (name in _BUILT_IN) + [plugin.distribution for plugin in found]
        raise BenchbotError(
            f"There is more than one callback '{name}'.",
            f"It is provided by {' and by '.join(owners)}.",
            f"Uninstall what you do not need: pip uninstall {found[-1].distribution}",
        )
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    if found:
        return _load(found[0])
    known = sorted({*_BUILT_IN, *(plugin.name for plugin in plugins)})
    raise BenchbotError(
        f"There is no callback '{name}'.",
        f"Known: {', '.join(known)}.{did_you_mean(name, known)}",
        "Correct callback_robot in the robot's declaration, or install the distribution that provides it.",
    )


def _load(point: PluginInfo) -> Callback:
    try:
        callback = pkgutil.resolve_name(point.module)
    # A third party's import may fail in any way at all.
    except (Exception, SystemExit) as error:  # noqa: BLE001
        cause = f"{type(error).__name__}: {error}"
    else:
        if isinstance(callback, Callback) and callback.name == point.name:
            return callback
        cause = f"{point.module} is {callback!r}, not a Callback of that name"
    raise BenchbotError(
        f"The callback '{point.name}' of {point.distribution} cannot be used.",
        f"{cause}.",
        f"Report this to the authors of {point.distribution}, or choose another callback_robot.",
    )


def _segments(parts: Mapping[str, Any]) -> Segmentation:
    classes = images.labels(parts["class_segment_img"], np.uint8)
    instances = images.labels(parts["instance_segment_img"], np.uint16)
    if classes.shape != instances.shape:
        raise ValueError(f"the classes' picture has the shape {classes.shape}, the instances' {instances.shape}")
    return {
        "class_segment_img": classes,
        "instance_segment_img": instances,
        "class_ids": _class_ids(parts["class_ids"].data),
    }


def _class_ids(text: str) -> dict[str, int]:
    try:
        return msgspec.json.decode(text, type=dict[str, int])
    except msgspec.DecodeError as error:
        raise ValueError(f'class_ids is not JSON of the form {{"chair": 1}}: {error}') from error


def _single(name: str, decode: Callable[[Any], Any], *types: str) -> Callback:
    return Callback(name, {"": frozenset(types)}, lambda parts: decode(parts[""]))


_IMAGE, _COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_PICTURES = frozenset({_IMAGE, _COMPRESSED})

_BUILT_IN = {
    callback.name: callback
    for callback in (
        _single("image_rgb", images.rgb, _IMAGE, _COMPRESSED),
        _single("image_rgb_info", sensors.camera_model, "sensor_msgs/msg/CameraInfo"),
        _single("image_depth", images.depth_m, _IMAGE, _COMPRESSED),
        _single("image_depth_info", sensors.camera_model, "sensor_msgs/msg/CameraInfo"),
        Callback(
            "image_segment",
            {
                "class_segment_img": _PICTURES,
                "instance_segment_img": _PICTURES,
                "class_ids": frozenset({"std_msgs/msg/String"}),
            },
            _segments,
        ),
        _single("image_segment_info", sensors.camera_model, "sensor_msgs/msg/CameraInfo"),
        _single("laser", sensors.laser, "sensor_msgs/msg/LaserScan"),
        _single("lidar", clouds.lidar, "sensor_msgs/msg/PointCloud2"),
        _single("imu", sensors.imu, "sensor_msgs/msg/Imu"),
        _single("joint_states", sensors.joint_states, "sensor_msgs/msg/JointState"),
    )
}
