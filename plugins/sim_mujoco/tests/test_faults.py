"""What is wrong with MuJoCo's sensors and walls is found as it is with the ray tracer's, in the same words."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from benchbot.core.declarations import schema
from benchbot.core.findings import Level
from benchbot.core.geometry import Pose
from benchbot.plugins.authoring.comparability import golden_room
from benchbot.plugins.authoring.comparability.checks import check_senses
from benchbot.plugins.authoring.comparability.senses import Sight
from benchbot.plugins.authoring.conformance.bench import Bench, make_bench
from benchbot.plugins.authoring.conformance.comparing import drive_at_the_wall, look_around
from benchbot.plugins.simulation import dynamics
from benchbot.plugins.simulation.dynamics import State
from benchbot.testing import as_text
from benchbot_sim_mujoco.simulator import MujocoSimulator
from plugins.sim_mujoco.tests.rooms import ROBOTS, scene, workshop
from plugins.sim_taichi.tests import sensor_faults
from plugins.sim_taichi.tests.sensor_faults import FAULTS

CAMERA = {"width": 64, "height": 36, "fx": 32, "fy": 32, "cx": 32, "cy": 18}
CHANNELS = ["image_rgb", "image_depth", "image_segment", "laser", "imu", "poses"]
# Carter's copy in MuJoCo has no lidar.
ELSEWHERE = ("mirrored lidar", "lidar upside down")


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    folder = tmp_path_factory.mktemp("workshop")
    robot = schema.read(ROBOTS / "carter_mujoco.yaml")
    room = scene(workshop(folder / "workshop.glb"), map_path=str(folder / "workshop.glb"))
    declared = robot | {"camera": robot["camera"] | CAMERA}
    return make_bench(MujocoSimulator, declared, room.environment, cache_dir=folder / "cache")


@pytest.fixture(scope="module")
def sights(bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Sequence[Sight]:
    folder = tmp_path_factory.mktemp("golden_room")
    infos = [f"{picture}_info" for picture in sensor_faults.PICTURES]
    with bench.fresh() as platform:
        starts = [golden_room.scene(folder, start, bench.scene.environment) for start in golden_room.STARTS]
        return look_around(platform, starts, CHANNELS + infos)


def test_a_correct_simulator_shows_what_is_there(bench: Bench, sights: Sequence[Sight]) -> None:
    findings = check_senses(sights, bench.spec.robot)
    assert {one.level for one in findings} == {Level.OK}, as_text(findings)


@pytest.mark.parametrize("name", [name for name in FAULTS if name not in ELSEWHERE])
def test_no_fault_of_a_sensor_passes(name: str, bench: Bench, sights: Sequence[Sight]) -> None:
    fault, subject, words = FAULTS[name]
    findings = check_senses(fault(sights), bench.spec.robot)
    broken = [one for one in findings if one.level is Level.BROKEN and subject in one.subject.split(", ")]
    assert any(words in one.detail for one in broken), as_text(findings)


class SeesNoWalls(MujocoSimulator):
    """Drives through everything."""

    def advance(self, linear_mps: float, angular_radps: float, duration_s: float) -> tuple[State, bool]:
        way = dynamics.drive(self.state, linear_mps, angular_radps, duration_s, self.robot.limits)
        super().advance(linear_mps, angular_radps, duration_s)
        end = list(way)[-1]
        self.world.physics.place(Pose.planar(end.x, end.y, end.yaw_rad, self._base_z_m))
        return end, False

    def contact_ahead(self, linear_mps: float, angular_radps: float, horizon_s: float) -> bool:
        return False


@pytest.mark.parametrize("simulator", [MujocoSimulator, SeesNoWalls])
def test_a_robot_that_walls_do_not_stop_is_found_out(
    simulator: type[MujocoSimulator], bench: Bench, tmp_path: Path
) -> None:
    room = golden_room.scene(tmp_path, golden_room.WALL_START, bench.scene.environment)
    tried = replace(bench, create=simulator)
    with tried.fresh() as platform:
        found = drive_at_the_wall(tried, platform, room)
    if simulator is MujocoSimulator:
        assert found.level is Level.OK
    else:
        assert found.level is Level.BROKEN
        assert "drives through walls" in found.detail
