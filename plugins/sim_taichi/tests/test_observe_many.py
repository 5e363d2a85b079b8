"""Robots that share scenes: what they observe together is what each observes by itself."""

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

import pytest

from benchbot.core.declarations import schema
from benchbot.core.digest import ObservationDigest
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.platform import ManyCameras, PlatformSpec, Scene
from benchbot.simulation import CHANNELS
from benchbot_sim_taichi.simulator import RayTracedSimulator

MINIROOM = Path(str(files("benchbot_envs_bear"))) / "environments" / "miniroom_1.yaml"
CARTER = schema.read(Path(str(files("benchbot_sim_taichi"))) / "robots" / "carter_lidar.yaml")
SMALL = CARTER | {"camera": CARTER["camera"] | {"width": 32, "height": 24, "fx": 16, "fy": 16, "cx": 16, "cy": 12}}

SEEN = [channel for channel in CHANNELS if channel != "joint_states"]
"""The channels of a robot without an arm."""

pytestmark = pytest.mark.xdist_group("renderer")


def scene(*labels: str) -> Scene:
    return Scene(schema.read(MINIROOM) | ({"object_labels": list(labels)} if labels else {}), MINIROOM.parent)


def digest(observed: Mapping[str, object]) -> str:
    found = ObservationDigest()
    found.update(observed)
    return found.hexdigest()


@pytest.fixture(scope="module")
def three(kernel_cache: Path) -> list[RayTracedSimulator]:
    """Two robots in one scene, one in another that differs in its labels."""
    first = RayTracedSimulator(PlatformSpec(SMALL, "noisy", kernel_cache))
    robots = [first, first.twin(), first.twin()]
    for number, (robot, place) in enumerate(zip(robots, (scene(), scene("bed"), scene()), strict=True)):
        robot.load(place, seed=number)
        for _ in range(4):
            robot.drive(0.3, 0.4 * number, robot.control_period_s)
    return robots


@pytest.mark.parametrize("channels", [SEEN, ["image_depth"], ["laser"], ["lidar"], ["poses"], []])
def test_each_sees_what_it_would_see_alone(three: list[RayTracedSimulator], channels: list[str]) -> None:
    together = three[0].observe_many(three, channels)
    assert [list(observed) for observed in together] == [channels] * 3
    assert [digest(observed) for observed in together] == [digest(robot.observe(channels)) for robot in three]


def test_a_robot_without_twins_sees_the_same(three: list[RayTracedSimulator], kernel_cache: Path) -> None:
    alone = RayTracedSimulator(PlatformSpec(SMALL, "noisy", kernel_cache))
    alone.load(scene(), seed=2)
    for _ in range(4):
        alone.drive(0.3, 0.8, alone.control_period_s)
    assert digest(three[0].observe_many(three, SEEN)[2]) == digest(alone.observe(SEEN))


def test_an_unknown_channel_is_explained(three: list[RayTracedSimulator]) -> None:
    with pytest.raises(BenchbotError, match="image_rbg"):
        three[0].observe_many(three, ["image_rbg"])


def test_twins_share_scenes_but_not_their_state() -> None:
    first = RayTracedSimulator(PlatformSpec(SMALL, "ground_truth", Path("unused")))
    assert isinstance(first, ManyCameras)
    second = first.twin()
    first.load(scene(), seed=0)
    second.load(scene(), seed=0)
    assert first.world is second.world
    first.place(Pose.planar(1.0, 0.0, 0.0))
    assert second.pose() != first.pose()
    assert second.pose().translation_xyz == scene().start_pose.translation_xyz


def test_closing_one_leaves_its_twins_alone() -> None:
    first = RayTracedSimulator(PlatformSpec(SMALL, "ground_truth", Path("unused")))
    second, third = first.twin(), first.twin()
    second.load(scene(), seed=0)
    first.close()
    third.load(scene(), seed=0)
    assert second.world is third.world
