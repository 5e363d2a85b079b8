"""Apartment, office and company: layouts from a seed, as they lie in the package."""

import json
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from benchbot.core.declarations import schema
from benchbot.core.motion import MotionConfig, Outcome, execute
from benchbot.core.platform import PlatformSpec, Scene
from benchbot_scenes.coverage import room_of
from benchbot_scenes.free_space import free_space
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.ground_truth import ground_truth
from benchbot_scenes.layout import read_layout
from benchbot_scenes.scene_file import scene_file
from benchbot_scenes.violations import driving_violations, placing_violations
from benchbot_scenes.visibility import observer
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.envs_bear.tests.conftest import package_file
from tools.bear.generated import NIGHTS, PLACES

VARIANTS = [f"{place}_{variant}" for place in PLACES for variant in range(1, 6)]
QUICK = "apartment_4"
EACH = [name if name == QUICK else pytest.param(name, marks=pytest.mark.slow) for name in VARIANTS]


def declared(name: str) -> dict[str, Any]:
    return schema.read(package_file("environments", f"{name}.yaml"))


def carter() -> dict[str, Any]:
    import benchbot_sim_taichi

    return schema.read(Path(benchbot_sim_taichi.__file__).parent / "robots" / "carter_lowres.yaml")


@pytest.mark.parametrize("name", VARIANTS)
def test_all_files_of_a_variant_are_there_and_agree(name: str) -> None:
    environment = declared(name)
    place, variant = name.split("_")
    assert (environment["name"], environment["variant"]) == (place, int(variant))
    assert environment["start_pose"] == environment["trajectory_poses"][0]
    truth = json.loads(package_file("ground_truths", f"{name}.json").read_text(encoding="utf-8"))
    assert truth["environment"] == environment
    assert 25 <= len(truth["ground_truth"]["objects"]) <= 85
    with Image.open(package_file("maps", f"{name}.png")) as occupancy:
        assert (occupancy.mode, {value for _, value in occupancy.getcolors() or ()}) == ("L", {0, 205, 254})
    assert environment["lighting"]["lamps"]["on"] == ("all" if int(variant) in NIGHTS else "none")


@pytest.mark.parametrize("name", [name for name in VARIANTS if not name.endswith("_1")])
def test_variants_differ_in_four_to_fifteen_objects(name: str) -> None:
    layout = read_layout(package_file("layouts", f"{name}.yaml"))
    assert layout.base is not None
    assert layout.base.name == f"{name.split('_', maxsplit=1)[0]}_1.yaml"
    assert 4 <= len(layout.removed) + len(layout.moved) + len(layout.objects) <= 15


@pytest.mark.parametrize("name", EACH)
def test_a_scene_is_sound_and_driven_to_the_end_without_contact(name: str, tmp_path: Path) -> None:
    environment, robot = declared(name), carter()
    layout = package_file("layouts", f"{name}.yaml")
    geometry = load_scene(scene_file(layout, tmp_path))
    assert placing_violations(read_layout(layout), geometry) == []
    assert driving_violations(geometry, environment["trajectory_poses"]) == []
    truth = json.loads(package_file("ground_truths", f"{name}.json").read_text(encoding="utf-8"))
    assert ground_truth(geometry, environment) == truth

    sees = observer(robot)
    space = free_space(geometry, sees.z_min_m, sees.z_max_m)
    assert room_of(geometry, space, environment["trajectory_poses"], sees) >= sees.radius_m + 0.02

    simulator = RayTracedSimulator(PlatformSpec(robot, "ground_truth", tmp_path))
    scene = Scene(environment, package_file("environments", f"{name}.yaml").parent)
    simulator.load(scene, 0)
    config = MotionConfig.from_robot(robot, "ground_truth")
    assert {execute(simulator, "move_next", {}, pose, config) for pose in scene.trajectory} == {Outcome.REACHED}
    assert not simulator.collided
