"""Checks of a robot's messages: cameras, depth, lasers, and the age of the data on each topic."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from benchbot.plugin import Finding, LaserScan, Level, Pose, wrap_angle_rad
from benchbot_robot_ros2.declaration_keys import Timing
from benchbot_robot_ros2.doctor.live_watch import Stream
from benchbot_robot_ros2.observing import longest_delay_s

# What a moving robot is stopped by must be fresh; pictures are taken at rest, and rendering one takes its time.
OLD_FEEDBACK_S, OLD_S = 0.25, 1.0
# Clocks that chrony keeps together differ by milliseconds; a simulated clock ticks in steps of tens of milliseconds.
AHEAD_S = 0.02
AHEAD_SIMULATED_S = 0.2
# Longer silences than so are none of a busy computer's.
STOPPED_S, STOPPED_GAPS = 1.0, 4
INVALID_DEPTH = 0.6
PLAUSIBLE_DEPTH_M = (0.05, 50.0)
FINITE_RANGES = 0.1
# A fixed sensor so far from its declared mount looks elsewhere: either the declaration or the URDF is wrong.
ELSEWHERE_M, ELSEWHERE_DEG = 0.25, 20.0
FRONT_RAD = math.radians(45)
RECTIFY = (
    "Run a rectifying node (ros2 run image_proc rectify_node) and declare its topic, such as …/image_rect, "
    "or switch rectification on in the camera's driver."
)
CLOCKS = (
    "Synchronise the clocks of both computers, for example with chrony (docs/ros2.md, time); "
    "for a simulator set driver.use_sim_time: true."
)
DEVICES = frozenset({"e_stop", "dead_man", "take_over", "collision", "battery"})
"""What counts as of when it arrives, whatever its stamp says: many such messages have none."""


def freshness(stream: Stream, timing: Timing, *, simulated: bool) -> Iterator[Finding]:
    """Say how often a topic's messages come, how old they are, and which frame they name."""
    use, subject = stream.use, f"topic {stream.use.topic.ros_topic}"
    rate_hz, age_s = stream.rate_hz, None if use.role in DEVICES else stream.age_s
    rate = "1 message" if rate_hz is None else f"{rate_hz:.1f} Hz"
    clean = True
    if use.rate_hz is not None and (rate_hz is None or rate_hz < use.rate_hz):
        clean = False
        fix = f"Have it published at {use.rate_hz:g} Hz or more: the robot is stopped when this feedback is late."
        yield Finding(Level.WARNING, subject, f"{rate} is too slow for {use.role}", fix)
    if age_s is not None:
        ahead_s = AHEAD_SIMULATED_S if simulated else AHEAD_S
        # What the driver itself accepts: a simulated robot's camera may be slow, its feedback may not.
        oldest_s = timing.skew_s if use.rate_hz is not None else longest_delay_s(timing, simulated=simulated)
        if not -timing.skew_s <= age_s <= oldest_s:
            clean = False
            direction = "old" if age_s > 0 else "in the future"
            yield Finding(Level.BROKEN, subject, f"its stamps are {abs(age_s):.2f} s {direction}", CLOCKS)
        elif age_s < -ahead_s:
            clean = False
            yield Finding(Level.WARNING, subject, f"its stamps are {-age_s * 1e3:.0f} ms in the future", CLOCKS)
        elif age_s > (OLD_FEEDBACK_S if use.rate_hz is not None else OLD_S):
            clean = False
            fix = "Use a wired or less busy network, smaller or compressed images, or a lower rate."
            yield Finding(Level.WARNING, subject, f"its messages are {age_s * 1e3:.0f} ms old when they come", fix)
    if clean:
        age = "" if age_s is None else f", {max(age_s, 0.0) * 1e3:.0f} ms old"
        yield Finding(Level.OK, subject, f"{use.role}, {rate}{age}")


def stopped(stream: Stream, now_ns: int) -> Finding | None:
    """Warn when a topic came regularly, and then no more until `now_ns` of the node's time.

    What comes by event is not looked at: optional topics, and devices that need not repeat themselves.
    """
    use, times = stream.use, [received for received, _ in stream.arrivals_ns]
    if use.optional or (use.role in DEVICES and use.rate_hz is None) or len(times) < 3:
        return None
    longest_s = max(later - earlier for earlier, later in pairwise(times)) / 1e9
    silent_s = (now_ns - times[-1]) / 1e9
    if silent_s < max(STOPPED_S, STOPPED_GAPS * longest_s):
        return None
    fix = "Look at that node's log; between two computers, at the firewall and the network (docs/ros2.md)."
    detail = f"it came each {longest_s:.2f} s at the longest, and not in the last {silent_s:.1f} s"
    return Finding(Level.WARNING, f"topic {use.topic.ros_topic}", detail, fix)


def frame(stream: Stream, base_frame: str) -> Iterator[Finding]:
    """Say whether a topic's last message names the frame that the declaration gives it."""
    use = stream.use
    named, wanted = getattr(getattr(stream.last, "header", None), "frame_id", None), use.frame_id
    key = {"odometry": "robot_frame", "localisation": "global_frame", "laser": "laser.frame"}.get(
        use.role, "camera.frame"
    )
    if use.role == "odometry":
        named, wanted = stream.last.child_frame_id, base_frame
    if wanted is not None and named is not None and named.lstrip("/") != wanted:
        fix = f"Declare {key}: {named} with its mount under frames, or correct the frame in the robot's driver."
        yield Finding(
            Level.BROKEN,
            f"topic {use.topic.ros_topic}",
            f"its messages are in the frame '{named}', declared is '{wanted}'",
            fix,
        )


def camera_info(topic: str, info: Any, size: tuple[int, int] | None) -> Iterator[Finding]:
    """Say whether a sensor_msgs/CameraInfo makes sense; `size` is the height and width of the camera's images."""
    subject = f"camera {topic}"
    fx, cx, fy, cy = (float(info.k[index]) for index in (0, 2, 4, 5))
    clean = True
    if not (fx > 0 and fy > 0):
        fix = "Calibrate it (ros2 run camera_calibration cameracalibrator), and have its driver publish the result."
        yield Finding(Level.BROKEN, subject, f"its focal lengths are {fx:g} and {fy:g} pixels", fix)
        return
    if size is not None and size != (info.height, info.width):
        clean = False
        detail = f"it describes {info.width}x{info.height} images, but they are {size[1]}x{size[0]}"
        fix = "Declare the camera_info of the same image topic, or have the driver scale it with the images."
        yield Finding(Level.BROKEN, subject, detail, fix)
    if not (0 < cx < info.width and 0 < cy < info.height):
        clean = False
        detail = f"its principal point ({cx:.1f}, {cy:.1f}) is outside the image of {info.width}x{info.height}"
        yield Finding(Level.BROKEN, subject, detail, "Calibrate the camera again.")
    distorted = any(abs(float(value)) > 1e-6 for value in info.d)
    if distorted:
        clean = False
        detail = f"its images are not rectified ({info.distortion_model} distortion), a solution takes them for pinhole"
        yield Finding(Level.WARNING, subject, detail, RECTIFY)
    elif not math.isclose(float(info.p[0]), fx, rel_tol=0.01) or not math.isclose(float(info.p[5]), fy, rel_tol=0.01):
        clean = False
        detail = f"K says fx={fx:.1f} fy={fy:.1f}, P says fx={info.p[0]:.1f} fy={info.p[5]:.1f}, without any distortion"
        yield Finding(Level.WARNING, subject, detail, "For rectified images both must agree: correct the calibration.")
    if clean:
        angle_deg = math.degrees(2 * math.atan(info.width / (2 * fx)))
        yield Finding(
            Level.OK, subject, f"{info.width}x{info.height}, fx={fx:.1f}, {angle_deg:.0f} degrees wide, rectified"
        )


def depth(topic: str, depth_m: Any) -> Iterator[Finding]:
    """Say whether an observation `image_depth` (float32 (H, W), metres) can be made use of."""
    subject = f"depth {topic}"
    valid = depth_m[np.isfinite(depth_m)]
    share = 1 - valid.size / depth_m.size
    if not valid.size:
        fix = "Uncover the camera, or look at the driver's log; check with ros2 topic echo --once."
        yield Finding(Level.BROKEN, subject, "no pixel is valid", fix)
        return
    median_m = float(np.median(valid))
    if not PLAUSIBLE_DEPTH_M[0] < median_m < PLAUSIBLE_DEPTH_M[1]:
        side = "beyond" if median_m > 1 else "nearer than"
        detail = f"half of it is {side} {median_m:g} m: that looks like another unit"
        fix = "REP-118 says metres for 32FC1 and millimetres for 16UC1: correct the driver's encoding."
        yield Finding(Level.BROKEN, subject, detail, fix)
    elif share > INVALID_DEPTH:
        fix = "Light the room, switch the infrared projector on, or stand away from glass and near walls."
        yield Finding(Level.WARNING, subject, f"{share:.0%} of the pixels are invalid", fix)
    else:
        yield Finding(Level.OK, subject, f"{share:.0%} of the pixels are invalid, median {median_m:.2f} m")


def laser(topic: str, scan: LaserScan, mount: Pose | None) -> Iterator[Finding]:
    """Say whether an observation `laser` sees anything, and what lies ahead of the robot."""
    subject = f"laser {topic}"
    ranges_m, angles_rad = scan["scans"][:, 0], scan["scans"][:, 1]
    finite = np.isfinite(ranges_m)
    if not finite.any():
        fix = "Start the scanner's motor and uncover it; is the robot in a hall wider than the scanner's range?"
        yield Finding(Level.BROKEN, subject, f"none of its {ranges_m.size} ranges is finite", fix)
        return
    clean = True
    yaw_rad = mount.yaw_rad if mount else 0.0
    ahead = [abs(wrap_angle_rad(float(angle) + yaw_rad)) < FRONT_RAD for angle in angles_rad]
    covered = sum(ahead) and _widest_gap_rad(angles_rad[ahead] + yaw_rad) < math.radians(10)
    if not covered:
        clean = False
        detail = f"it does not see the {2 * math.degrees(FRONT_RAD):.0f} degrees ahead of the robot as it is mounted"
        fix = "Check laser.frame and its mount's yaw under frames; a scanner that looks elsewhere is no guard."
        yield Finding(Level.WARNING, subject, detail, fix)
    if finite.mean() < FINITE_RANGES:
        clean = False
        fix = "Clean and level the scanner; most beams come back in a room."
        yield Finding(Level.WARNING, subject, f"only {finite.mean():.0%} of its ranges are finite", fix)
    if clean:
        nearest_m = float(ranges_m[finite].min())
        detail = f"{ranges_m.size} ranges, {finite.mean():.0%} finite, the nearest {nearest_m:.2f} m"
        yield Finding(Level.OK, subject, detail)


def mount(frame_id: str, declared: Pose | None, measured: Pose, *, fixed: bool = False) -> Finding:
    """Compare a frame's declared mount with the one that the transforms tell; a `fixed` one cannot have moved."""
    x, y, z = measured.translation_xyz
    roll, pitch, yaw = (math.degrees(angle) for angle in measured.rpy_rad)
    written = f"{frame_id}: {{xyz: [{x:.4f}, {y:.4f}, {z:.4f}], rpy_deg: [{roll:.2f}, {pitch:.2f}, {yaw:.2f}]}}"
    subject = f"frame {frame_id}"
    if declared is None:
        return Finding(Level.WARNING, subject, "its mount is not declared", f"Add under frames: {written}")
    apart = declared.inverse() @ measured
    distance_m = math.dist((0, 0, 0), apart.translation_xyz)
    angle_deg = math.degrees(2 * math.acos(min(1.0, abs(apart.rotation_xyzw[3]))))
    if distance_m > 0.01 or angle_deg > 1:
        detail = f"declared {distance_m * 100:.1f} cm and {angle_deg:.1f} degrees from where the transforms put it"
        elsewhere = fixed and (distance_m > ELSEWHERE_M or angle_deg > ELSEWHERE_DEG)
        level = Level.BROKEN if elsewhere else Level.WARNING
        return Finding(level, subject, detail, f"If the transforms are right, write under frames: {written}")
    return Finding(Level.OK, subject, "mounted where it is declared")


def _widest_gap_rad(angles_rad: Any) -> float:
    """Return the widest gap between neighbouring beams ahead, the rims of the sector among them."""
    wrapped = (np.asarray(angles_rad) + np.pi) % (2 * np.pi) - np.pi
    return float(np.diff(np.concatenate([[-FRONT_RAD], np.sort(wrapped), [FRONT_RAD]])).max())
