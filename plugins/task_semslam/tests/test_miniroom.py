"""The example mapper in the simulated miniroom, scored by object map quality."""

import pytest

from benchbot.core.catalog import Catalog
from benchbot.core.host import InProcessHost
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.core.plugins import load
from benchbot.core.resources import cache_dir
from benchbot.core.schema import read
from benchbot.evaluation import evaluate
from benchbot.plugins.formats import object_map
from benchbot_task_semslam.examples.segmentation_mapper import ObjectMap, describe

CHANNELS = ["image_depth", "image_depth_info", "image_segment", "poses"]
TASK = "semantic_slam:passive:ground_truth:segmentation"


@pytest.mark.slow
def test_a_map_of_the_miniroom_is_good() -> None:
    catalog = Catalog(load())
    environment = catalog.get("environments", "miniroom:1")
    robot = catalog.get("robots", "carter_lowres").data
    simulator = catalog.plugins.record("simulators", robot["type"])
    scene = Scene(environment.data, environment.path.parent)
    platform = simulator.create(PlatformSpec(robot, "ground_truth", cache_dir()))
    host = InProcessHost(platform, [scene], MotionConfig.from_robot(robot, "ground_truth"))
    host.load(0, seed=0)
    mapped = ObjectMap()
    for goal in scene.trajectory:
        mapped.add(host.observe(CHANNELS))
        host.act("move_next", {}, goal)
    host.close()

    result = {
        "task_details": catalog.get("tasks", TASK).data,
        "environment_details": [environment.data],
        "results": object_map.create()
        | {"objects": [describe(item, object_map.CLASS_LIST) for item in mapped.objects]},
    }
    truth = next(path for path in catalog.ground_truth_files if path.name == "miniroom_1.json")
    scores = evaluate(result, [read(truth)])["scores"]

    assert len(mapped.objects) == 18
    assert scores["OMQ"] > 0.85
