"""Properties of `observe`: what it returns, of which instant, and whose it is."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

from benchbot.core.digest import ObservationDigest
from benchbot.core.findings import Finding
from benchbot.core.geometry import wrap_angle_rad
from benchbot.core.platform import Platform
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, drive
from benchbot.plugins.authoring.conformance.observations import check_value
from benchbot.plugins.authoring.conformance.properties import Wrong, look

PICTURES = ("image_rgb", "image_depth", "image_segment")


def look_at_channels(bench: Bench, platform: Platform) -> list[Finding]:
    """Return a finding for each channel that the robot declares."""
    return [look(f"observe: {name}", partial(_channel, bench, platform, name)) for name in bench.channels]


def _channel(bench: Bench, platform: Platform, name: str) -> str:
    platform.load(bench.scene, SEED)
    said = ""
    for _ in range(2):
        said = check_value(name, platform.observe([name])[name])
        drive(platform, 0.0, 0.5, 0.3)
    return said


def returns_what_is_asked(bench: Bench, platform: Platform) -> str:
    """The asked channels and no others, however many."""
    platform.load(bench.scene, SEED)
    for wanted in ((), bench.channels[:1], bench.channels):
        seen = platform.observe(wanted)
        if set(seen) != set(wanted):
            raise Wrong(
                f"Asked for {list(wanted)}, it returned {list(seen)}.", "Return the asked channels, all of them."
            )
    return f"{len(bench.channels)} channels"


def is_of_one_instant(bench: Bench, platform: Platform) -> str:
    """Looking takes no time and moves nothing, and everything in it is of the present."""
    platform.load(bench.scene, SEED)
    drive(platform, 0.1, 0.4, 0.5)
    before, clock_s = platform.pose(), platform.clock()
    seen = platform.observe(bench.channels)
    if not bench.real and (platform.pose() != before or platform.clock() != clock_s):
        raise Wrong("The robot or its clock moved while it looked.", "Let time pass in drive() only.")
    frame = bench.spec.robot["robot_frame"]
    if "poses" in seen and bench.spec.localisation == "ground_truth" and frame in seen["poses"]:
        told = seen["poses"][frame]
        away_m = math.dist(told["translation_xyz"][:2], before.translation_xyz[:2])
        turned_rad = abs(wrap_angle_rad(told["rotation_rpy"][2] - before.yaw_rad))
        if away_m > bench.position_tolerance_m or turned_rad > bench.angle_tolerance_rad:
            raise Wrong(
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
                raise Wrong(
                    f"{name} is {picture.shape[:2]}, its model {info['height']} x {info['width']} (height x width).",
                    f"Give {name}_info of the picture as it is.",
                )


def declares_its_frames(bench: Bench, platform: Platform) -> str:
    """`poses` has the frames that the robot declares, beside initial_pose and camera."""
    platform.load(bench.scene, SEED)
    if "poses" not in bench.channels:
        return "the robot has no poses"
    seen = platform.observe(["poses"])["poses"]
    missing = [frame for frame in bench.spec.robot["poses"] if frame not in seen]
    if missing:
        raise Wrong(
            f"poses lacks {', '.join(missing)}.", "Give every frame that the robot's declaration lists in poses."
        )
    parents = {pose["parent_frame"] for pose in seen.values()}
    if parents != {bench.spec.robot["global_frame"]}:
        raise Wrong(
            f"The parent frames are {sorted(parents)}.",
            f"Give poses in '{bench.spec.robot['global_frame']}', all of them.",
        )
    return ", ".join(seen)


def stays_as_it_was(bench: Bench, platform: Platform) -> str:
    """What was observed is not written on later: others still read it."""
    platform.load(bench.scene, SEED)
    seen = []
    for _ in range(3):
        observed = platform.observe(bench.channels)
        seen.append((observed, digest(observed)))
        drive(platform, 0.05, 0.5, 0.3)
    if any(digest(observed) != then for observed, then in seen):
        raise Wrong(
            "An observation changed after it was handed out.", "Return arrays that are never written on again: copies."
        )
    return "three observations in a row"


def digest(observed: Mapping[str, Any]) -> str:
    """Return the digest of observations, to the byte."""
    running = ObservationDigest()
    running.update(observed)
    return running.hexdigest()
