"""Environments whose scene is a layout: driven without being looked at."""

from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_scenes.layout import Building, Layout, Move, Opening, Placement, Room, write_layout
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.sim_taichi.tests.test_simulator import robot

ROOMS = (
    Room("west", ((0, 0), (3, 0), (3, 3), (0, 3)), "oak", "#e9e2d2", "#ffffff"),
    Room("east", ((3.1, 0), (6, 0), (6, 3), (3.1, 3)), "carpet_grey", "#d8e0e4", "#ffffff"),
)
DOOR = Opening("door", "door", (3.05, 1.5), 1.0, 0.0, 2.05, open_deg=90.0)
LAYOUT = Layout("household", Building(2.5, 0.3, ROOMS, (DOOR,)), (Placement("table", "table_round", (5.2, 1.5, 0.0)),))
MOTION = MotionConfig.from_robot(robot(), "ground_truth")


def loaded(folder: Path, map_path: str = "layout.yaml", **more: Any) -> RayTracedSimulator:
    """A simulator with the robot in the western room, facing the door."""
    platform = RayTracedSimulator(PlatformSpec(robot(), "ground_truth", folder / "cache"))
    environment = {
        "name": "flat",
        "variant": 1,
        "type": "sim_taichi",
        "map_path": map_path,
        "start_pose": [1, 0, 0, 0, 1, 1.5, 0],
        **more,
    }
    schema.check(environment, "environment", folder / "flat.yaml")
    platform.load(Scene(environment, folder), seed=0)
    return platform


def test_the_robot_drives_through_an_open_door_up_to_what_stands_behind(tmp_path: Path) -> None:
    write_layout(tmp_path / "layout.yaml", LAYOUT)
    platform = loaded(tmp_path)
    assert execute(platform, "move_distance", {"distance": 4.0}, None, MOTION) is Outcome.BLOCKED
    x, y, _ = platform.pose().translation_xyz
    assert 3.5 < x < 5.0
    assert y == pytest.approx(1.5)
    assert list((tmp_path / "cache" / "scenes").glob("*.glb"))


def test_a_variant_moves_it_out_of_the_way(tmp_path: Path) -> None:
    write_layout(tmp_path / "layout.yaml", LAYOUT)
    moved = Layout("household", base=tmp_path / "layout.yaml", moved=(Move("table", (5.2, 2.4, 0.0)),))
    write_layout(tmp_path / "variant.yaml", moved)
    platform = loaded(tmp_path, "variant.yaml")
    assert execute(platform, "move_distance", {"distance": 4.0}, None, MOTION) is Outcome.REACHED


def test_a_broken_layout_is_named_with_its_line(tmp_path: Path) -> None:
    write_layout(tmp_path / "layout.yaml", LAYOUT)
    text = (tmp_path / "layout.yaml").read_text()
    (tmp_path / "layout.yaml").write_text(text.replace("height_m: 2.5", "height_m: tall"))
    with pytest.raises(BenchbotError, match="not a valid layout") as caught:
        loaded(tmp_path)
    assert "layout.yaml:3: 'tall' is not of type 'number'" in caught.value.why
