"""The sample simulator: a real platform, small enough to read in one go."""

import math
import os
import time
from collections.abc import Callable, Iterable, Mapping
from typing import cast

import numpy as np
from numpy.typing import NDArray

from benchbot.core.channels import CameraModel, FramePose, LaserScan, Observations, Segmentation
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.geometry import Pose
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_sample import view, world
from benchbot_sample.unicycle import Limits, State, rollout, substeps

LASER_BEAMS = 36
LASER_RANGE_M = (0.05, 10.0)


class SampleSimulator:
    """A disc on wheels among posts and walls.

    An environment's `options` make it break on purpose: `crash_after_steps: N` ends the process in the N-th observation
    after the first, `hang_after_steps: N` never returns from it, `safety_stop_after_steps: N` raises a safety stop in
    it, `fail_at_load: true` raises in `load`. As a real robot, it waits `tick_sleep_s` in each control tick, stops when
    it is told to (`halts: true`), and has its operator carry it to its start (`ask_operator: true`).
    """

    def __init__(self, spec: PlatformSpec) -> None:
        self._limits = Limits.from_mapping(spec.robot["limits"])
        self._radius_m = float(spec.robot["footprint"]["radius_m"])
        self._noise: Mapping[str, float] = spec.robot.get("noise", {})
        self._frames: list[str] = list(spec.robot["poses"])
        self._localisation = spec.localisation
        self._ask = spec.ask
        self._tell = spec.tell
        self._note = spec.note
        self._halted: str | None = None

    @property
    def control_period_s(self) -> float:
        """Return the control tick: 20 Hz."""
        return 0.05

    def load(self, scene: Scene, seed: int) -> None:
        """Put the robot at the start pose of a fresh world."""
        self._options = scene.environment.get("options", {})
        if self._options.get("fail_at_load"):
            raise BenchbotError(
                "The sample world does not load.",
                "Its environment asks for that.",
                "Choose another environment.",
                failure=FailureClass.PLATFORM,
            )
        if self._options.get("ask_operator"):
            self._have_it_carried()
        if "taken_over_s" in self._options and self._tell is not None:
            self._tell("A person has the robot.")
            time.sleep(float(str(self._options["taken_over_s"])))
            self._tell(None)
        if self._note is not None:
            self._note("the simulator reads its world")
        self._world = world.read(scene.folder / scene.environment["map_path"])
        self._class_ids = {name: number for number, name in enumerate(scene.environment.get("object_labels", ()), 1)}
        self._instances = _instance_ids(self._world.labels, self._class_ids)
        self._start = scene.start_pose
        x, y, self._z = self._start.translation_xyz
        self._state = self._believed = State(x, y, self._start.yaw_rad)
        self._random = np.random.default_rng(seed)
        self._clock_s = 0.0
        self._collided = False
        self._observed = 0

    def observe(self, channels: Iterable[str]) -> Observations:
        """Return the asked channels."""
        self._break_on_purpose()
        self._observed += 1
        seen = view.look(self._world, self._state.x, self._state.y, self._state.yaw_rad)
        makers: dict[str, Callable[[], object]] = {
            "image_rgb": lambda: seen.rgb,
            "image_depth": lambda: seen.depth_m,
            "image_segment": lambda: self._segments(seen.obstacle),
            "laser": self._laser,
            "poses": self._poses,
        }
        makers |= dict.fromkeys(("image_rgb_info", "image_depth_info", "image_segment_info"), _camera_info)
        return cast(Observations, {name: makers[name]() for name in channels})

    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        """Apply one control tick, up to contact."""
        time.sleep(self._options.get("tick_sleep_s", 0.0))
        if self._halted is not None and self._options.get("halts"):
            raise _safety_stop(self._halted)
        before = self._state
        for state in substeps(before, linear_mps, angular_radps, duration_s, self._limits):
            if self._touches(state):
                self._collided = True
                self._state = self._up_to_contact(self._state, state)
                break
            self._state = state
        self._clock_s += duration_s
        self._dead_reckon(before, self._state)

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        """Say whether this command and then braking would touch something."""
        ahead = rollout(self._state, linear_mps, angular_radps, horizon_s, self._limits)
        return self._touches(*ahead)

    def pose(self) -> Pose:
        """Return the true pose of the base."""
        return Pose.planar(self._state.x, self._state.y, self._state.yaw_rad, self._z)

    def odometry(self) -> Pose:
        """Return where dead reckoning believes the base is."""
        return Pose.planar(self._believed.x, self._believed.y, self._believed.yaw_rad, self._z)

    @property
    def velocity(self) -> tuple[float, float]:
        """Return the current velocity."""
        return (self._state.linear_mps, self._state.angular_radps)

    @property
    def collided(self) -> bool:
        """Return whether the robot has touched something since `load`."""
        return self._collided

    def clock(self) -> float:
        """Return simulated seconds since `load`."""
        return self._clock_s

    def place(self, base: Pose) -> None:
        """Put the robot, at rest, somewhere else."""
        x, y, _ = base.translation_xyz
        self._state = State(x, y, base.yaw_rad)

    def halt(self, why: str) -> None:
        """Stop, where the environment asks for a robot that does; else nobody is in danger."""
        self._halted = why

    def close(self) -> None:
        """Release nothing: there is nothing to release."""

    def _have_it_carried(self) -> None:
        if self._ask is None:
            raise BenchbotError(
                "There is nobody to carry the robot.",
                "Its environment asks for an operator.",
                "Choose another environment.",
                failure=FailureClass.PLATFORM,
            )
        self._ask("Carry the robot to its start.")

    def _break_on_purpose(self) -> None:
        if self._observed == self._options.get("safety_stop_after_steps"):
            raise _safety_stop("Something came too close.")
        if self._observed == self._options.get("crash_after_steps"):
            os.abort()
        while self._observed == self._options.get("hang_after_steps"):
            time.sleep(3600)

    def _touches(self, *states: State) -> bool:
        points = np.array([(state.x, state.y) for state in states])
        return bool(np.any(self._world.clearance_m(points) < self._radius_m))

    def _up_to_contact(self, free: State, touching: State) -> State:
        for _ in range(20):
            middle = State((free.x + touching.x) / 2, (free.y + touching.y) / 2, (free.yaw_rad + touching.yaw_rad) / 2)
            free, touching = (free, middle) if self._touches(middle) else (middle, touching)
        return State(free.x, free.y, free.yaw_rad)

    def _dead_reckon(self, before: State, after: State) -> None:
        forward = (after.x - before.x) * math.cos(before.yaw_rad) + (after.y - before.y) * math.sin(before.yaw_rad)
        turn = after.yaw_rad - before.yaw_rad
        linear, angular = self._random.normal(0.0, [self._noise.get("linear", 0.0), self._noise.get("angular", 0.0)])
        if forward or turn:
            self._believed = self._believed.moved(float(forward * (1 + linear)), float(turn * (1 + angular)), 1.0)

    def _segments(self, obstacle: NDArray[np.int64]) -> Segmentation:
        # Index -1 (nothing) wraps to the last entry, which is the unlabelled one.
        instances = self._instances[obstacle]
        return {
            "class_segment_img": (instances // 1000).astype(np.uint8),
            "instance_segment_img": instances,
            "class_ids": {name: number for name, number in self._class_ids.items() if name in self._world.labels},
        }

    def _laser(self) -> LaserScan:
        angles = np.linspace(-np.pi, np.pi, LASER_BEAMS, endpoint=False)
        low, high = LASER_RANGE_M
        ranges, _ = self._world.cast(self._state.x, self._state.y, angles + self._state.yaw_rad)
        ranges = np.where(ranges > high, np.inf, ranges)
        return {"scans": np.stack([ranges, angles], 1), "range_min": low, "range_max": high}

    def _poses(self) -> dict[str, FramePose]:
        base = self.odometry() if self._localisation == "noisy" else self.pose()
        offered = {"base_link": base, "initial_pose": self._start, "camera": base @ view.CAMERA_TO_BASE, "lidar": base}
        return {name: offered[name].record("map") for name in self._frames}


class TracedSimulator(SampleSimulator):
    """The simulator, which says what device it runs on."""

    def __init__(self, spec: PlatformSpec) -> None:
        super().__init__(spec)
        self._spec = spec

    def provenance(self) -> dict[str, str]:
        """Return the device, which changes nothing."""
        from benchbot_sample.plugin import device

        return {"device": device(self._spec.options)}


def _safety_stop(why: str) -> BenchbotError:
    return BenchbotError(
        "The robot was stopped for safety.",
        why,
        "Look at the robot.",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.PLATFORM,
        ends_run=True,
    )


def _instance_ids(labels: tuple[str | None, ...], class_ids: Mapping[str, int]) -> NDArray[np.uint16]:
    """Return class * 1000 + number within the class for each label, and a last 0 for nothing."""
    counts: dict[int, int] = {}
    ids = []
    for label in labels:
        number = class_ids.get(label, 0) if label else 0
        counts[number] = counts.get(number, 0) + 1
        ids.append(number * 1000 + counts[number] if number else 0)
    return np.array([*ids, 0], dtype=np.uint16)


def _camera_info() -> CameraModel:
    return {
        "frame_id": "camera",
        "height": view.HEIGHT,
        "width": view.WIDTH,
        "matrix_intrinsics": view.INTRINSICS.copy(),
        "matrix_projection": np.hstack([view.INTRINSICS, np.zeros((3, 1))]),
    }
