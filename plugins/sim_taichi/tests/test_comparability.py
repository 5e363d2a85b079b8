"""The ray tracer shows what stands in the golden room; what is wrong with a sensor is found, in words of the fault."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.channels import Observations
from benchbot.core.declarations import schema
from benchbot.core.findings import Finding, Level
from benchbot.evaluation import occupancy_map
from benchbot.plugins.authoring.comparability import golden_room
from benchbot.plugins.authoring.comparability.across import check_boxes, check_laser, check_map
from benchbot.plugins.authoring.comparability.checks import check_senses
from benchbot.plugins.authoring.comparability.senses import Sight
from benchbot.plugins.authoring.comparability.world import World
from benchbot.plugins.authoring.conformance.bench import Bench, make_bench
from benchbot.plugins.authoring.conformance.comparing import check_comparability, drive_at_the_wall, look_around
from benchbot.plugins.simulation.contact import Clearance
from benchbot.testing import as_text
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.sim_taichi.tests import sensor_faults
from plugins.sim_taichi.tests.sensor_faults import FAULTS
from plugins.sim_taichi.tests.test_simulator import MINIROOM, ROBOTS

pytestmark = pytest.mark.xdist_group("renderer")
CAMERA = {"width": 64, "height": 36, "fx": 32, "fy": 32, "cx": 32, "cy": 18}
CHANNELS = ["image_rgb", "image_depth", "image_segment", "laser", "lidar", "imu", "poses"]
INFOS = [f"{picture}_info" for picture in sensor_faults.PICTURES]


@pytest.fixture(scope="module")
def bench(kernel_cache: Path) -> Bench:
    robot = schema.read(ROBOTS / "carter_lidar.yaml")
    return make_bench(
        RayTracedSimulator, robot | {"camera": robot["camera"] | CAMERA}, MINIROOM, cache_dir=kernel_cache
    )


@pytest.fixture(scope="module")
def sights(bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Sequence[Sight]:
    """What a correct simulator observes in the golden room."""
    folder = tmp_path_factory.mktemp("golden_room")
    with bench.fresh() as platform:
        starts = [golden_room.scene(folder, start, bench.scene.environment) for start in golden_room.STARTS]
        return look_around(platform, starts, CHANNELS + INFOS)


@pytest.fixture(scope="module")
def in_the_miniroom(bench: Bench) -> Sequence[Sight]:
    """What it observes in a room of which only the ground truth and the map are known."""
    with bench.fresh() as platform:
        return look_around(platform, [bench.scene], [name for name in CHANNELS + INFOS if name != "image_rgb"])


def broken(findings: Sequence[Finding]) -> dict[str, str]:
    """What is broken, by channel."""
    bad = [one for one in findings if one.level is Level.BROKEN]
    return {channel: one.detail for one in bad for channel in one.subject.split(", ")}


def test_a_correct_simulator_shows_what_is_there(bench: Bench, sights: Sequence[Sight]) -> None:
    findings = check_senses(sights, bench.spec.robot)
    assert {one.level for one in findings} == {Level.OK}, as_text(findings)
    assert {"image_depth", "image_segment", "image_rgb", "laser", "lidar", "imu", "poses"} <= {
        one.subject for one in findings
    }


@pytest.mark.parametrize("name", FAULTS)
def test_no_fault_of_a_sensor_passes(name: str, bench: Bench, sights: Sequence[Sight]) -> None:
    fault, subject, words = FAULTS[name]
    findings = check_senses(fault(sights), bench.spec.robot)
    assert words in broken(findings)[subject], as_text(findings)


def test_the_faults_that_are_found_are_listed_in_the_documentation() -> None:
    page = (Path(__file__).parents[3] / "docs" / "plugins.md").read_text("utf-8")
    listed = page.partition("They are: ")[2].partition(" ([`sensor_faults.py`]")[0]
    assert listed.split(", ") == list(FAULTS)
    assert f"{len(FAULTS)} faults are put, one at a time" in page


def test_one_fault_of_all_pictures_is_one_finding(bench: Bench, sights: Sequence[Sight]) -> None:
    fault, _, _ = FAULTS["mirrored pictures"]
    (found,) = [one for one in check_senses(fault(sights), bench.spec.robot) if one.level is Level.BROKEN]
    assert found.subject == "image_depth, image_segment, image_rgb"
    assert found.detail.startswith("The picture is mirrored left to right")


@pytest.mark.parametrize(
    ("name", "subject", "words"),
    [
        ("mirrored pictures", "image_segment: boxes", sensor_faults.MIRRORED),
        ("mirrored pictures", "laser", sensor_faults.MIRRORED),
        ("shifted by 8 px", "image_segment: boxes", "shifted by 8 px"),
        ("Euclidean depth", "laser", "Euclidean"),
        ("upside down", "image_segment: boxes", "is upside down"),
        ("mirrored laser", "laser", "the scan is mirrored"),
        ("mirrored laser", "laser: map", "the scan is mirrored"),
        ("laser turned back", "laser: map", "turned by 180 degrees"),
    ],
)
def test_faults_are_found_in_any_room_by_its_ground_truth_and_map(
    name: str, subject: str, words: str, bench: Bench, in_the_miniroom: Sequence[Sight]
) -> None:
    faulty = FAULTS[name][0](blank_colors(in_the_miniroom))
    assert words.lower() in broken(across(bench, faulty))[subject].lower()


def test_a_correct_simulator_agrees_with_ground_truth_and_map(bench: Bench, in_the_miniroom: Sequence[Sight]) -> None:
    findings = across(bench, in_the_miniroom)
    assert {one.level for one in findings} == {Level.OK}, as_text(findings)
    assert len(findings) == 3


class Mirrored(RayTracedSimulator):
    """Flips its pictures."""

    def observe_many(self, platforms: Sequence[Any], channels: Iterable[str]) -> list[Observations]:
        seen = super().observe_many(platforms, channels)
        for one in seen:
            for name in {"image_rgb", "image_depth"} & one.keys():
                one[name] = one[name][:, ::-1]  # type: ignore[literal-required]
            if "image_segment" in one:
                labels = one["image_segment"]
                labels["class_segment_img"] = labels["class_segment_img"][:, ::-1]
                labels["instance_segment_img"] = labels["instance_segment_img"][:, ::-1]
        return seen


def test_the_kit_finds_it_in_a_simulator_in_the_golden_room_and_in_the_scene(bench: Bench) -> None:
    mirrored = replace(bench, create=Mirrored)
    with mirrored.fresh() as platform:
        found = broken(check_comparability(mirrored, platform, "miniroom:1", []))
    named = {subject for subject, detail in found.items() if detail.startswith("The picture is mirrored left to right")}
    assert {"golden room: image_depth", "scene: image_depth", "image_segment: boxes"} <= named


def test_walls_stop_the_robot(bench: Bench, tmp_path: Path) -> None:
    scene = golden_room.scene(tmp_path, golden_room.WALL_START, bench.scene.environment)
    with bench.fresh() as platform:
        found = drive_at_the_wall(bench, platform, scene)
    assert found.level is Level.OK
    assert "panel" in found.detail


class SeesNoWalls(RayTracedSimulator):
    """Drives through everything."""

    def _new_clearance(self) -> Clearance:
        return Nowhere(self.world.clearance_m, self.robot.footprint.radius_m)


class Nowhere(Clearance):
    """Far from everything."""

    def exactly_m(self, state: Any) -> float:
        return math.inf

    def exceeds(self, state: Any, distance_m: float) -> bool:
        return True


class StopsEverywhere(RayTracedSimulator):
    """Bumps into what is not there."""

    @property
    def collided(self) -> bool:
        return self._clock_s > 0.5


@pytest.mark.parametrize(
    ("simulator", "words"),
    [(SeesNoWalls, "drives through walls"), (StopsEverywhere, "stopped by nothing")],
)
def test_a_robot_that_walls_do_not_stop_is_found_out(
    simulator: type[RayTracedSimulator], words: str, bench: Bench, tmp_path: Path
) -> None:
    scene = golden_room.scene(tmp_path, golden_room.WALL_START, bench.scene.environment)
    blind = replace(bench, create=simulator)
    with blind.fresh() as platform:
        found = drive_at_the_wall(blind, platform, scene)
    assert found.level is Level.BROKEN
    assert words in found.detail


def across(bench: Bench, sights: Sequence[Sight]) -> list[Finding]:
    robot, scene = bench.spec.robot, bench.scene
    truth = schema.read(scene.folder.parent / "ground_truths" / "miniroom_1.json")
    floor = occupancy_map.read(occupancy_map.map_file(scene.environment, scene.folder))
    world = World.of_ground_truth(truth["ground_truth"])
    return [*check_boxes(sights, robot, world), *check_laser(sights, robot), *check_map(sights, robot, floor)]


def blank_colors(sights: Sequence[Sight]) -> list[Sight]:
    """The sights with a picture, which faults of all pictures want and which these checks do not look at."""
    import numpy as np

    blank = np.zeros((CAMERA["height"], CAMERA["width"], 3), np.uint8)
    return [replace(sight, observations={**sight.observations, "image_rgb": blank}) for sight in sights]
