"""What `benchbot new simulator --from ros2` makes, with our own bridge as the simulator."""

import json
import os
import subprocess
from pathlib import Path

import pytest
import yaml

from benchbot.plugins.authoring.scaffold.render import create
from plugins.robot_ros2.tests.test_same_solution import COMMAND, NOOK, bridge_on_a_domain, environment
from tests.conftest import SAMPLE_PLUGIN
from tests.plugin_factory import DECLARES, PluginFactory


@pytest.mark.xdist_group("robots 1")
def test_its_robot_is_reset_and_driven_in_a_running_simulator(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = create("simulator-ros2", "acme-gazebo", tmp_path / "made") / "src" / "acme_gazebo"
    robot = yaml.safe_load((source / "robots" / "acme_gazebo_robot.yaml").read_text())
    place = yaml.safe_load((source / "environments" / "acme_gazebo_room_1.yaml").read_text())
    arena = Path(SAMPLE_PLUGIN) / "benchbot_sample" / "environments" / "arena_1.yaml"
    assert (place["start_pose"], place["trajectory_poses"]) == (NOOK["start_pose"], NOOK["trajectory_poses"])
    (tmp_path / "site").mkdir()
    PluginFactory(tmp_path / "site").make(
        "acme-gazebo",
        "\n".join(DECLARES.format(kind=kind) for kind in ("robots", "environments")),
        {
            "robots/acme_gazebo_robot.yaml": json.dumps(robot),
            "environments/acme_gazebo_room_1.yaml": json.dumps(place),
            "environments/nook_1.yaml": json.dumps(environment(arena, "nook", NOOK)),
        },
    )
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path / "site"), os.environ["PYTHONPATH"]]))
    task = "semantic_slam:passive:ground_truth"
    selected = ("--task", task, "--robot", "acme_gazebo_robot", "--env", "acme_gazebo_room:1")
    with bridge_on_a_domain("--robot", "sample_careful_robot", "--env", "nook:1", "--camera-rate-hz", "20"):
        for number in range(2):
            result = tmp_path / f"{number}.json"
            words = ["submit", *selected, "--example", "hello_passive", "--results-location", str(result)]
            done = subprocess.run([*COMMAND, *words], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            provenance = json.loads(result.read_text())["provenance"]
            assert (provenance["failure"], provenance["steps"]) == (None, len(NOOK["trajectory_poses"]))
