"""The sample simulator conforms; each variant of it that breaks one promise is found out."""

import os
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchbot_sample.simulator import SampleSimulator

from benchbot.core.channels import LaserScan, Observations
from benchbot.core.geometry import Pose
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.records import RobotDriver, Simulator
from benchbot.testing import check_robot_driver, check_simulator
from tests.conftest import SAMPLE_PLUGIN
from tests.plugins.authoring.conformance.reading import all_is_well, broken, warned

SAMPLE = Path(SAMPLE_PLUGIN) / "benchbot_sample"
# By file, for it takes longer to read all that is installed than to check a platform.
ROBOT, ARENA = SAMPLE / "robots" / "sample_robot.yaml", SAMPLE / "environments" / "arena_1.yaml"


def test_the_sample_simulator_conforms() -> None:
    findings = check_simulator("sim_sample", "sample_robot", "arena:1")
    # Its worlds are posts and walls of its own: it loads no plain scene.
    assert list(warned(findings)) == ["golden room: load"]
    assert all_is_well(one for one in findings if one.subject != "golden room: load")
    assert {"clean start", "drive: contact", "seeds: repeated", "observe: laser", "nothing left"} <= {
        finding.subject for finding in findings
    }


class ForgetsToGoBack(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        state = getattr(self, "_state", None)
        super().load(scene, seed)
        self._state = state or self._state


class KeepsItsClock(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        clock_s = getattr(self, "_clock_s", 0.0)
        super().load(scene, seed)
        self._clock_s = clock_s


class StaysCollided(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        collided = getattr(self, "_collided", False)
        super().load(scene, seed)
        self._collided = collided


class ReadsTheQuaternionWrong(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        super().load(scene, seed)
        self.place(Pose.planar(-2.0, 0.0, 1.0))


class HasNoUnitQuaternion(SampleSimulator):
    def pose(self) -> Pose:
        true = super().pose()
        return Pose(true.translation_xyz, tuple(2 * value for value in true.rotation_xyzw))  # type: ignore[arg-type]


class NeverRests(SampleSimulator):
    @property
    def velocity(self) -> tuple[float, float]:
        return (0.1, 0.0) if self._clock_s else (0.0, 0.0)


class Creeps(SampleSimulator):
    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        super().drive(linear_mps or 0.3, angular_radps, duration_s)
        if not linear_mps:
            self.place(self.pose())


class SeesTooMuch(SampleSimulator):
    def observe(self, channels: Iterable[str]) -> Observations:
        return super().observe({*channels, "image_rgb", "poses"})


class LooksForALongTime(SampleSimulator):
    def observe(self, channels: Iterable[str]) -> Observations:
        self.drive(0.1, 0.0, 0.05)
        return super().observe(channels)


class TellsOldPoses(SampleSimulator):
    def observe(self, channels: Iterable[str]) -> Observations:
        seen = super().observe(channels)
        if "poses" in seen:
            seen["poses"]["base_link"] = self._start.record("map")
        return seen


class HidesItsLaser(SampleSimulator):
    def observe(self, channels: Iterable[str]) -> Observations:
        seen = super().observe(channels)
        if "poses" in seen:
            del seen["poses"]["lidar"]
        return seen


class GivesPosesToItself(SampleSimulator):
    def observe(self, channels: Iterable[str]) -> Observations:
        seen = super().observe(channels)
        for pose in seen.get("poses", {}).values():
            pose["parent_frame"] = "odom"
        return seen


class WritesOnWhatItGave(SampleSimulator):
    def observe(self, channels: Iterable[str]) -> Observations:
        seen = super().observe(channels)
        if "image_rgb" in seen:
            self._buffer = vars(self).setdefault("_buffer", np.empty_like(seen["image_rgb"]))
            self._buffer[:] = seen["image_rgb"]
            seen["image_rgb"] = self._buffer
        return seen


class IsUpsideDown(SampleSimulator):
    def observe(self, channels: Iterable[str]) -> Observations:
        seen = super().observe(channels)
        if "image_depth_info" in seen:
            info = seen["image_depth_info"]
            info["height"], info["width"] = info["height"] + 1, info["width"]
        return seen


class DrivesBackwards(SampleSimulator):
    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        super().drive(-linear_mps, angular_radps, duration_s)


class DrivesInMillimetres(SampleSimulator):
    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        super().drive(linear_mps / 10, angular_radps, duration_s)


class Drifts(SampleSimulator):
    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        super().drive(linear_mps, angular_radps + 0.5 * linear_mps, duration_s)


class TurnsClockwise(SampleSimulator):
    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        super().drive(linear_mps, -angular_radps, duration_s)


class HurriesTime(SampleSimulator):
    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        super().drive(linear_mps, angular_radps, duration_s)
        self._clock_s += 0.01


class IsTooFast(SampleSimulator):
    @property
    def velocity(self) -> tuple[float, float]:
        linear_mps, angular_radps = super().velocity
        return linear_mps, 40 * angular_radps


class DrivesThroughWalls(SampleSimulator):
    def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
        before = self._collided
        super().drive(linear_mps, angular_radps, duration_s)
        if before:
            self.place(self.pose() @ Pose((linear_mps * duration_s, 0.0, 0.0)))


class SeesNothingComing(SampleSimulator):
    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        return False


class MeetsNothing(SampleSimulator):
    def _touches(self, *states: Any) -> bool:
        return False


class DrawsFromNowhere(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        super().load(scene, seed)
        self._random = np.random.default_rng()


class DrawsFromItsPast(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        generator = getattr(self, "_random", None)
        super().load(scene, seed)
        self._random = generator or self._random


class StartsByChance(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        super().load(scene, seed)
        x, y, _ = self.pose().translation_xyz
        self.place(Pose.planar(x + 1e-6 * seed, y, self.pose().yaw_rad))


class LeaksAThread(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        super().load(scene, seed)
        self._done = threading.Event()
        threading.Thread(target=self._done.wait, args=(60,), daemon=True).start()


class LeaksAFile(SampleSimulator):
    def load(self, scene: Scene, seed: int) -> None:
        super().load(scene, seed)
        os.open("/dev/null", os.O_RDONLY)


class ClosesOnce(SampleSimulator):
    def close(self) -> None:
        if vars(self).setdefault("_closed", False):
            raise RuntimeError("closed already")
        self._closed = True


class TicksSlowly(SampleSimulator):
    @property
    def control_period_s(self) -> float:
        return 2.0


@pytest.mark.parametrize(
    ("simulator", "subject", "words"),
    [
        (ForgetsToGoBack, "clean start", "away from the scene's start pose after a second load"),
        (KeepsItsClock, "clean start", "clock() is"),
        (StaysCollided, "drive: contact", "still collided after load()"),
        (ReadsTheQuaternionWrong, "clean start", "turned by 57.3 degrees"),
        (HasNoUnitQuaternion, "rigid poses", "has the norm 2"),
        (NeverRests, "rest", "still moves"),
        (Creeps, "rest", "moved by"),
        (SeesTooMuch, "observe: what was asked", "Asked for []"),
        (LooksForALongTime, "observe: one instant", "moved while it looked"),
        (TellsOldPoses, "observe: one instant", "away from pose()"),
        (HidesItsLaser, "observe: frames", "lacks lidar"),
        (GivesPosesToItself, "observe: frames", "parent frames are ['odom']"),
        (WritesOnWhatItGave, "observe: left alone", "changed after it was handed out"),
        (IsUpsideDown, "observe: one instant", "height x width"),
        (DrivesBackwards, "drive: straight", "Positive is ahead"),
        (DrivesInMillimetres, "drive: straight", "+0.02 m where +0.2 m were commanded"),
        (Drifts, "drive: straight", "left the straight line"),
        (TurnsClockwise, "drive: turns", "counter-clockwise"),
        (HurriesTime, "drive: time", "in a drive() of 0.05 s"),
        (IsTooFast, "drive: limits", "its limit is 1"),
        (DrivesThroughWalls, "drive: contact", "into what it had hit"),
        (SeesNothingComing, "drive: contact", "contact_ahead() was False"),
        (DrawsFromNowhere, "seeds: repeated", "on the same platform"),
        (DrawsFromItsPast, "seeds: repeated", "on the same platform"),
        (StartsByChance, "seeds: another", "start pose depends on the seed"),
        (LeaksAThread, "nothing left", "threads open"),
        (LeaksAFile, "nothing left", "files open"),
        (ClosesOnce, "close", "RuntimeError: closed already"),
        (TicksSlowly, "control period", "2.0"),
    ],
)
def test_a_broken_promise_is_found_out(simulator: type[SampleSimulator], subject: str, words: str) -> None:
    findings = check_simulator(Simulator("sim_sample", simulator), ROBOT, ARENA)
    assert words in broken(findings)[subject]


def test_what_cannot_be_made_is_told_and_nothing_else_is_tried() -> None:
    def create(spec: PlatformSpec) -> SampleSimulator:
        raise OSError("no display")

    findings = check_simulator(Simulator("sim_sample", create), ROBOT, ARENA)
    assert list(broken(findings)) == ["create"]
    assert "OSError: no display" in findings[0].detail
    assert "test_platforms.py" in findings[0].fix


def test_a_missing_member_is_named() -> None:
    class Half:
        def close(self) -> None:
            pass

    findings = check_simulator(Simulator("sim_sample", lambda spec: Half()), ROBOT, ARENA)  # type: ignore[arg-type,return-value]
    assert "Half lacks control_period_s, load, observe" in broken(findings)["members"]


def test_a_robot_that_drives_through_what_its_laser_sees_is_found_out() -> None:
    findings = check_simulator(Simulator("sim_sample", MeetsNothing), ROBOT, ARENA)
    assert "drives through walls" in broken(findings)["drive: contact"]


def test_a_world_without_anything_to_hit_is_a_warning() -> None:
    class SeesNothing(MeetsNothing):
        def _laser(self) -> LaserScan:
            seen = super()._laser()
            seen["scans"][:, 0] = np.inf
            return seen

    findings = check_simulator(Simulator("sim_sample", SeesNothing), ROBOT, ARENA)
    assert broken(findings) == {}
    assert "nothing to hit" in warned(findings)["drive: contact"]


def test_wrong_types_are_one_finding_at_the_lines_of_their_author() -> None:
    class GivesTuples(SampleSimulator):
        def pose(self) -> Pose:
            return super().pose().translation_xyz  # type: ignore[return-value]

        @property
        def collided(self) -> bool:
            return np.bool_(False)  # type: ignore[return-value]

    found = broken(check_simulator(Simulator("sim_sample", GivesTuples), ROBOT, ARENA))
    assert list(found) == ["types"]
    pose_line = GivesTuples.pose.__code__.co_firstlineno
    assert f"test_platforms.py:{pose_line}," in found["types"]
    assert "pose gives (-2.0, 0.0, 0.0) (tuple), not a benchbot.plugin.Pose" in found["types"]
    assert "collided gives" in found["types"]


def test_what_breaks_every_property_is_told_once() -> None:
    class Raises(SampleSimulator):
        def drive(self, linear_mps: float, angular_radps: float, duration_s: float) -> None:
            raise RuntimeError("no wheels")

    found = broken(check_simulator(Simulator("sim_sample", Raises), ROBOT, ARENA))
    (told,) = [text for text in found.values() if "no wheels" in text]
    assert "The same in: " in told
    assert "drive: turns" in told


def test_a_real_robot_may_not_drive_after_halt() -> None:
    findings = check_robot_driver(RobotDriver("real_sample", SampleSimulator), ROBOT, ARENA)
    assert "It drives after halt()" in broken(findings)["halt"]
    assert "drive: contact" not in {finding.subject for finding in findings}


def test_a_real_robot_that_halts_conforms() -> None:
    assert broken(check_robot_driver("real_sample", "sample_real_robot", "faulty:halts")) == {}
