"""Properties of `observe`: channels, instants, frames and noise."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

from benchbot.core.findings import Finding
from benchbot.core.geometry import Pose, wrap_angle_rad
from benchbot.core.platform import ManyCameras, Platform
from benchbot.plugins.authoring.conformance.bench import LARGEST_SEED, SEED, Bench, drive
from benchbot.plugins.authoring.conformance.observations import check_value, digest
from benchbot.plugins.authoring.conformance.properties import Violation, check_property

PICTURES = ("image_rgb", "image_depth", "image_segment")
Run = tuple[list[str], list[Pose]]
"""The digests of the observations on a path, and the poses of the odometry."""


def check_channels(bench: Bench, platform: Platform) -> list[Finding]:
    """Return a finding for each channel that the robot declares."""
    return [check_property(f"observe: {name}", partial(_channel, bench, platform, name)) for name in bench.channels]


def _channel(bench: Bench, platform: Platform, name: str) -> str:
    platform.load(bench.scene, SEED)
    description = ""
    for _ in range(2):
        seen: Mapping[str, object] = platform.observe([name])
        description = check_value(name, seen[name])
        drive(platform, 0.0, 0.5, 0.3)
    return description


def returns_what_is_asked(bench: Bench, platform: Platform) -> str:
    """The asked channels are returned and no others, however many."""
    platform.load(bench.scene, SEED)
    for wanted in ((), bench.channels[:1], bench.channels):
        seen = platform.observe(wanted)
        if set(seen) != set(wanted):
            raise Violation(
                f"Asked for {list(wanted)}, it returned {list(seen)}.", "Return the asked channels, all of them."
            )
    return f"{len(bench.channels)} channels"


def observes_one_instant(bench: Bench, platform: Platform) -> str:
    """An observation takes no time and moves nothing, and all of its channels are of the present."""
    platform.load(bench.scene, SEED)
    drive(platform, 0.1, 0.4, 0.5)
    before, clock_s = platform.pose(), platform.clock()
    seen = platform.observe(bench.channels)
    if not bench.real and (platform.pose() != before or platform.clock() != clock_s):
        raise Violation("The robot or its clock moved while it looked.", "Let time pass in drive() only.")
    frame = bench.spec.robot["robot_frame"]
    if "poses" in seen and bench.spec.localisation == "ground_truth" and frame in seen["poses"]:
        told = seen["poses"][frame]
        away_m = math.dist(told["translation_xyz"][:2], before.translation_xyz[:2])
        turned_rad = abs(wrap_angle_rad(told["rotation_rpy"][2] - before.yaw_rad))
        if away_m > bench.position_tolerance_m or turned_rad > bench.angle_tolerance_rad:
            raise Violation(
                f"The pose of '{frame}' in poses is {away_m:.3g} m and {math.degrees(turned_rad):.3g} degrees "
                "away from pose().",
                "Make all channels of the same state.",
            )
    _pictures_agree(seen)
    return "pose, clock and pictures agree"


def _pictures_agree(seen: Mapping[str, Any]) -> None:
    for name in PICTURES:
        if name in seen and f"{name}_info" in seen:
            picture = seen[name]["class_segment_img"] if name == "image_segment" else seen[name]
            info = seen[f"{name}_info"]
            if picture.shape[:2] != (info["height"], info["width"]):
                raise Violation(
                    f"{name} is {picture.shape[:2]}, its model {info['height']} x {info['width']} (height x width).",
                    f"Give {name}_info of the picture as it is.",
                )


def has_its_frames(bench: Bench, platform: Platform) -> str:
    """`poses` has the frames that the robot declares, beside initial_pose and camera."""
    platform.load(bench.scene, SEED)
    if "poses" not in bench.channels:
        return "the robot has no poses"
    seen = platform.observe(["poses"])["poses"]
    missing = [frame for frame in bench.spec.robot["poses"] if frame not in seen]
    if missing:
        raise Violation(
            f"poses lacks {', '.join(missing)}.", "Give every frame that the robot's declaration lists in poses."
        )
    parents = {pose["parent_frame"] for pose in seen.values()}
    if parents != {bench.spec.robot["global_frame"]}:
        raise Violation(
            f"The parent frames are {sorted(parents)}.",
            f"Give poses in '{bench.spec.robot['global_frame']}', all of them.",
        )
    return ", ".join(seen)


def leaves_observations_alone(bench: Bench, platform: Platform) -> str:
    """Arrays are not written on after they were handed out: others still read them."""
    platform.load(bench.scene, SEED)
    seen = []
    for _ in range(3):
        observed = platform.observe(bench.channels)
        seen.append((observed, digest(observed)))
        drive(platform, 0.05, 0.5, 0.3)
    if any(digest(observed) != then for observed, then in seen):
        raise Violation(
            "An observation changed after it was handed out.", "Return arrays that are never written on again: copies."
        )
    return "three observations in a row"


def repeats_itself(bench: Bench, platform: Platform) -> str:
    """The same seed gives the same bytes: again on the same platform, and on a fresh one."""
    first = _run(bench, platform, SEED)
    _require_same(first, _run(bench, platform, SEED), "on the same platform")
    with bench.fresh() as another:
        _require_same(first, _run(bench, another, SEED), "on a fresh platform")
    return "the same bytes on the same platform and on a fresh one"


def changes_only_noise_with_the_seed(bench: Bench, platform: Platform) -> str:
    """The start pose and the sensors are the same for every seed."""
    platform.load(bench.scene, SEED)
    start = platform.pose()
    seen: Mapping[str, object] = platform.observe(bench.channels)
    platform.load(bench.scene, LARGEST_SEED)
    if platform.pose() != start:
        raise Violation("The start pose depends on the seed.", "Start where the scene says, whatever the seed.")
    other: Mapping[str, object] = platform.observe(bench.channels)
    for name in bench.channels:
        if _form(seen[name]) != _form(other[name]):
            raise Violation(f"Shapes or types of {name} depend on the seed.", "Draw noise from the seed, nothing else.")
        if name.endswith("_info") and digest({name: seen[name]}) != digest({name: other[name]}):
            raise Violation(f"{name} depends on the seed.", "Draw noise from the seed, nothing else.")
    return "start pose, shapes and camera models are those of every seed"


def observes_together_as_alone(bench: Bench, platform: Platform) -> str:
    """Many robots that observe at once observe, to the byte, what each would observe alone."""
    if not isinstance(platform, ManyCameras):
        return "one robot at a time"
    platform.load(bench.scene, SEED)
    twin: Any = platform.twin()
    twin.load(bench.scene, SEED + 1)
    together = platform.observe_many([platform, twin], bench.channels)
    platform.load(bench.scene, SEED)
    twin.load(bench.scene, SEED + 1)
    alone = [each.observe(bench.channels) for each in (platform, twin)]
    twin.close()
    if [digest(seen) for seen in together] != [digest(seen) for seen in alone]:
        raise Violation("observe_many differs from observe.", "Give each twin the bytes that it would observe alone.")
    return "two at once, to the byte"


def _run(bench: Bench, platform: Platform, seed: int) -> Run:
    platform.load(bench.scene, seed)
    seen, poses = [], []
    for angular_radps in (0.4, -0.2):
        drive(platform, 0.05, angular_radps, 0.3)
        seen.append(digest(platform.observe(bench.channels)))
        poses.append(platform.odometry())
    return seen, poses


def _require_same(first: Run, second: Run, where: str) -> None:
    for measured, one, another in zip(("observations", "odometry"), first, second, strict=True):
        if one != another:
            raise Violation(
                f"The same seed gives other {measured} {where}.",
                "Draw all noise from a generator that load() makes of its seed.",
            )


def _form(value: Any) -> Any:
    """Return the types and shapes in a value, without its numbers."""
    if isinstance(value, dict):
        return {key: _form(entry) for key, entry in value.items()}
    return (str(value.dtype), value.shape) if hasattr(value, "dtype") else type(value).__name__
