"""What a robot observed in the golden room, held against what stands there: a finding for each sense.

Pure functions of observations, of the robot's declaration (its calibration) and of the world.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from benchbot.core.findings import Finding, Level
from benchbot.plugins.authoring.comparability import agreement, faults, golden_room, labels
from benchbot.plugins.authoring.comparability.agreement import Explained, explain
from benchbot.plugins.authoring.comparability.senses import (
    Picture,
    Scan,
    Sight,
    laser_scans,
    lidar_scans,
    mounted,
    pictures,
)
from benchbot.plugins.authoring.comparability.world import Floats, World

PICTURES = ("image_depth", "image_segment", "image_rgb")
LEAST = {"image_depth": 0.93, "image_segment": 0.85, "image_rgb": 0.8, "laser": 0.93, "lidar": 0.93}
"""The least share that agrees. The ray tracer has 1.0, of colours in small pictures 0.97."""
FULL = {"image_rgb": 0.95}
"""The share that leaves nothing to explain, where it is not `agreement.FULL`."""
MOUNT_TOLERANCE_M, MOUNT_TOLERANCE_RAD = 0.005, 0.01
BIAS_SHARE, BIAS_M = 0.01, 0.02
PANEL_RATIOS = (3.5, 18.0)
"""The light of the panels in one picture is 8 : 1; bytes that are no sRGB make 20 : 1 to 60 : 1 of it, or 2.6 : 1."""
DARKEST, BRIGHTEST = 12, 243
GRAVITY_MPS2, GRAVITY_TOLERANCE_MPS2 = 9.81, 0.6


def check_senses(sights: Sequence[Sight], robot: Mapping[str, Any], world: World = golden_room.ROOM) -> list[Finding]:
    """Return findings on all that a robot observed, at rest, in a world of which everything is known."""
    found = [*_frames(sights, robot), *_alive(sights)]
    dead = {one.subject for one in found if one.level is Level.BROKEN}
    seen = {channel: pictures(sights, channel, robot) for channel in PICTURES if channel not in dead}
    scans = {"laser": laser_scans(sights, robot), "lidar": lidar_scans(sights, robot)}
    explained = [(name, *_of_pictures(name, taken, sights, robot, world)) for name, taken in seen.items() if taken]
    explained += [
        (name, _of_scans(name, taken, sights, robot, world), "ranges")
        for name, taken in scans.items()
        if taken and name not in dead
    ]
    whole = {channel for channel, one, _ in explained if one.fault is None}
    classes = list(labels.check_classes(sights, robot, world)) if "image_segment" in whole else []
    if any(one.level is Level.BROKEN for one in classes):
        explained = [entry for entry in explained if entry[0] != "image_segment"]
    elif "image_segment" in whole:
        classes += labels.check_instances(sights, robot, world)
    brightness = _brightness(sights, robot, world) if "image_rgb" in whole else ()
    return [*found, *_together(explained), *classes, *brightness, *_gravity(sights, robot)]


def _of_pictures(
    channel: str, seen: Sequence[Picture], sights: Sequence[Sight], robot: Mapping[str, Any], world: World
) -> tuple[Explained, str]:
    """Return how well the pictures of a channel agree with the world, and what their pixels are called."""
    fewer = [picture.thinned() for picture in seen]
    mounts = _mounts(sights, robot, robot.get("camera", {}).get("frame"))
    score, what, own = agreement.lengths_agree(world), "depths", list(faults.depth_faults())
    if channel == "image_segment":
        score, what, own = agreement.labels_agree(world, labels.class_ids(sights)), "labelled pixels", []
    elif channel == "image_rgb":
        score, what = agreement.colors_agree(world, golden_room.PALETTE), "coloured pixels"
        own = list(faults.color_faults())
    else:
        own += faults.length_faults(seen, agreement.expected_lengths(seen, world), "depth")

    def known() -> Iterator[faults.Fault]:
        yield from (*faults.camera_faults(), *own)
        yield from faults.frame_faults("camera", _bases(sights), mounts)
        yield from faults.scene_faults()
        # Last, as it tries a hundred shifts to find one.
        yield from faults.shift_faults(score, fewer)

    explained = explain(seen, score, known, FULL.get(channel, agreement.FULL))
    return (_bias(explained, seen, world, "depth") if channel == "image_depth" else explained), what


def _of_scans(
    channel: str, scans: Sequence[Scan], sights: Sequence[Sight], robot: Mapping[str, Any], world: World
) -> Explained:
    """Return how well the scans of a channel agree with the world."""
    mounts = _mounts(sights, robot, robot.get(channel, {}).get("frame"))

    def known() -> Iterator[faults.Fault]:
        true_m = agreement.expected_lengths(scans, world)
        yield from (*faults.scan_faults(), *faults.length_faults(scans, true_m, "a range"))
        yield from (*faults.frame_faults(channel, _bases(sights), mounts), *faults.scene_faults())

    return _bias(explain(scans, agreement.lengths_agree(world), known), scans, world, "a range")


def _bias(explained: Explained, seen: Sequence[Any], world: World, sense: str) -> Explained:
    """Return the fault of lengths that agree within their tolerance, but are all too long or too short."""
    if explained.fault is not None or explained.share < min(LEAST.values()):
        return explained
    expected = agreement.expected_lengths(seen, world)
    pairs = [np.stack([one.values.ravel(), true.ravel()]) for one, true in zip(seen, expected, strict=True)]
    measured, true_m = np.concatenate(pairs, axis=1)
    known = np.isfinite(measured) & np.isfinite(true_m)
    off_m = measured[known] - true_m[known]
    if not known.any() or abs(np.median(off_m / true_m[known])) < BIAS_SHARE or abs(np.median(off_m)) < BIAS_M:
        return explained
    (fault,) = faults.length_faults(seen, expected, sense)
    return Explained(explained.share, fault, agreement.lengths_agree(world)(fault.undo(seen)))


def _bases(sights: Sequence[Sight]) -> list[Floats]:
    return [sight.base.matrix() for sight in sights]


def _mounts(sights: Sequence[Sight], robot: Mapping[str, Any], frame: str | None) -> list[Floats]:
    """Return the poses that a frame has by the robot's declaration; none where that does not say."""
    mount = robot.get("frames", {}).get(frame)
    return [] if mount is None else [(sight.base @ mounted(mount)).matrix() for sight in sights]


def _together(explained: Sequence[tuple[str, Explained, str]]) -> Iterator[Finding]:
    """Yield the findings; one for all channels that have the same fault."""
    by_words: dict[str, list[tuple[str, Explained, str]]] = {}
    for entry in explained:
        fault = entry[1].fault
        by_words.setdefault(entry[0] if fault is None else fault.words, []).append(entry)
    for entries in by_words.values():
        channel, first, what = entries[0]
        yield agreement.finding(", ".join(name for name, _, _ in entries), first, LEAST[channel], what)


def _frames(sights: Sequence[Sight], robot: Mapping[str, Any]) -> Iterator[Finding]:
    """Check that frames are where the robot's declaration mounts them."""
    mounts = {str(frame): frame for frame in robot.get("frames", {})}
    camera = robot.get("camera", {}).get("frame")
    if camera in mounts:
        mounts["camera"] = camera
    wrong, right = [], []
    for name, frame in mounts.items():
        told = [pose for sight in sights if (pose := sight.pose_told(name)) is not None]
        if len(told) != len(sights):
            continue
        off = [np.linalg.inv(true) @ pose for true, pose in zip(_mounts(sights, robot, frame), told, strict=True)]
        away_m = max(float(np.linalg.norm(each[:3, 3])) for each in off)
        turned_rad = max(float(np.arccos(np.clip((np.trace(each[:3, :3]) - 1) / 2, -1, 1))) for each in off)
        if away_m > MOUNT_TOLERANCE_M or turned_rad > MOUNT_TOLERANCE_RAD:
            wrong.append(f"{name} by {away_m:.3g} m and {np.degrees(turned_rad):.3g} degrees")
        else:
            right.append(name)
    if wrong:
        detail = f"Frames are not where the robot's declaration mounts them: {'; '.join(wrong)}."
        fix = "A frame's pose is pose() @ its mount in `frames`; an optical frame has z ahead (rpy_deg -90, 0, -90)."
        yield Finding(Level.BROKEN, "poses", detail, fix)
    elif right:
        yield Finding(Level.OK, "poses", f"{', '.join(right)}: where they are mounted")


def _alive(sights: Sequence[Sight]) -> Iterator[Finding]:
    """Check that pictures and scans are not blank, and not the same everywhere."""
    for channel in LEAST:
        seen = [_values(sight.observations[channel]) for sight in sights if channel in sight.observations]
        words = _blank(channel, seen) if seen else ""
        if words:
            detail = f"{words}, in a lit room of walls and coloured objects."
            yield Finding(Level.BROKEN, channel, detail, "Render the scene that was loaded, from where the robot is.")


def _blank(channel: str, seen: Sequence[Any]) -> str:
    """Return in words what is blank or frozen; empty where nothing is."""
    finite = [values[np.isfinite(values)] for values in seen]
    if not any(values.size for values in finite):
        return "Nothing is measured: no value is a finite number"
    if channel == "image_rgb":
        if all(values.max() <= DARKEST for values in seen):
            return "The picture is black"
        if all(values.min() >= BRIGHTEST for values in seen):
            return "The picture is white"
        if all(np.ptp(values, axis=-1).max() <= DARKEST for values in seen):
            return "The picture has no colours"
    if channel == "image_segment" and not any(values.any() for values in seen):
        return "Nothing is labelled"
    if all(np.ptp(values) == 0 for values in finite if values.size):
        return "All values are the same"
    if len(seen) > 1 and all(np.array_equal(seen[0], values, equal_nan=True) for values in seen):
        return "It never changes, wherever the robot looks"
    return ""


def _values(value: Any) -> Any:
    if isinstance(value, Mapping):
        key = next(key for key in ("class_segment_img", "scans", "ranges_m") if key in value)
        return value[key][:, 0] if key == "scans" else value[key]
    return value


def _brightness(sights: Sequence[Sight], robot: Mapping[str, Any], world: World) -> Iterator[Finding]:
    """Check that bytes of colours are sRGB: by two greys of which one has eight times the other's reflectance."""
    light, dark = ([box.name for box in world.boxes].index(name) for name in golden_room.PANELS)
    ratios = []
    for picture in pictures(sights, "image_rgb", robot):
        _, index = world.cast(picture.origin, picture.directions())
        if min(np.sum(index == light), np.sum(index == dark)) >= labels.FEWEST_PIXELS:
            values = agreement.linear_rgb(picture.values).mean(-1)
            ratios.append(float(np.median(values[index == light]) / max(np.median(values[index == dark]), 1e-6)))
    if not ratios:
        return
    ratio, (low, high) = float(np.median(ratios)), PANEL_RATIOS
    text = f"two greys that reflect 8 : 1 are {ratio:.3g} : 1 in the picture"
    if low <= ratio <= high:
        yield Finding(Level.OK, "image_rgb: brightness", text)
        return
    how = "it is encoded twice" if ratio < low else "it is linear light, not encoded as sRGB"
    detail = f"T{text[1:]}: {how}, or its contrast is wrong."
    yield Finding(Level.BROKEN, "image_rgb: brightness", detail, "Encode linear light once, as IEC 61966-2-1 has it.")


def _gravity(sights: Sequence[Sight], robot: Mapping[str, Any]) -> Iterator[Finding]:
    """Check that an accelerometer at rest measures gravity's reaction."""
    mount = robot.get("frames", {}).get(robot.get("imu", {}).get("frame"))
    for sight in sights[:1]:
        if "imu" not in sight.observations:
            return
        turned = (sight.base if mount is None else sight.base @ mounted(mount)).matrix()[:3, :3]
        up: Floats = turned @ sight.observations["imu"]["linear_acceleration_mps2"]
        if np.isnan(up).any():
            return
        text = f"({', '.join(f'{value:.2f}' for value in up)}) m/s² at rest, in the map frame"
        if np.linalg.norm(up - (0.0, 0.0, GRAVITY_MPS2)) <= GRAVITY_TOLERANCE_MPS2:
            yield Finding(Level.OK, "imu", text)
        else:
            fix = "At rest it is gravity's reaction, +9.81 upwards (REP-145), in the frame of the device."
            yield Finding(Level.BROKEN, "imu", f"The acceleration is {text}.", fix)
