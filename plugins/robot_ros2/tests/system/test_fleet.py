"""Two submissions on two robots of one declaration, on one machine: one is stopped, the other comes home."""

import json
from collections.abc import Callable
from typing import Any

import pytest
import yaml

from benchbot.core.errors import ExitCode
from plugins.robot_ros2.tests.system.chain import PLUGIN, assert_stays, plugin_files
from plugins.robot_ros2.tests.unicycle import PATIENCE_S, fleet_declaration, unicycle, until
from tests.command_line import CommandLine

WALK = """\
import json
from benchbot.api import BenchBot

benchbot = BenchBot()
benchbot.step("move_distance", distance=DISTANCE)
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""


@pytest.fixture
def cli(domain: int, cli: CommandLine, make_plugin: Callable[..., Any]) -> CommandLine:
    cli.variables["BENCHBOT_PLUGINS"] = "benchbot-robot-ros2"
    fleet = fleet_declaration()
    fleet["limits"]["linear_mps"] = [-0.2, 0.2]
    fleet |= {"runs_in": ["real"], "fleet": {name: {"namespace": name} for name in ("r1", "r2")}}
    make_plugin("benchbot-hall", PLUGIN, plugin_files() | {"robots/unicycle.yaml": yaml.safe_dump(fleet)})
    return cli


def test_one_of_two_runs_is_stopped_by_its_robot_and_the_results_say_which_was_which(cli: CommandLine) -> None:
    def submit(robot: str, distance_m: float) -> Any:
        script = cli.script(f"{robot}.py", WALK.replace("DISTANCE", str(distance_m)))
        chosen = ("--task", "walk", "--robot", robot, "--env", "hall:1")
        return cli.start("submit", *chosen, "--native", script, "-r", f"{robot}.json")

    with unicycle(namespace="r1", wall_x_m=28.0) as first, unicycle(namespace="r2") as second:
        slow = submit("unicycle@r1", 25.0)
        until(lambda: first.state["x"] > 0.02, 2 * PATIENCE_S)
        other = submit("unicycle@r2", 1.0)
        until(lambda: second.state["x"] > 0.02, 2 * PATIENCE_S)

        stopped = cli("stop", "--run", "unicycle@r1")
        assert stopped.returncode == 0, stopped.stderr
        assert "walk on unicycle@r1 in hall:1" in stopped.stderr
        assert "It goes on: " in stopped.stderr

        assert other.wait(2 * PATIENCE_S) == 0, other.communicate()
        assert slow.wait(2 * PATIENCE_S) == ExitCode.INTERNAL
        until(lambda: first.state["rested_s"] is not None)
        assert_stays(first)
        assert first.state["x"] < 24.0
        assert second.state["x"] == pytest.approx(1.0, abs=0.05)

    selections = {}
    for robot in ("unicycle@r1", "unicycle@r2"):
        document = json.loads((cli.folder / f"{robot}.json").read_text())
        selections[document["provenance"]["selection"]["robot"]] = document["provenance"]["failure"]
    assert selections["unicycle@r2"] is None
    assert selections["unicycle@r1"]["class"] == "platform"


def test_the_robots_of_a_fleet_are_listed_and_found_by_name(cli: CommandLine) -> None:
    listed = cli("list", "robots").stdout
    assert "unicycle@r1" in listed
    assert "unicycle@r2" in listed

    chosen = ("--task", "walk", "--env", "hall:1", "--native", "true")
    unknown = cli("submit", "--robot", "unicycle", *chosen)
    assert unknown.returncode == ExitCode.USAGE
    assert "'unicycle' is not a known robot" in unknown.stderr
    assert "Did you mean 'unicycle@r" in unknown.stderr

    guessed = cli("submit", "--robot", "unicycle@r1", *chosen, "--set", "driver.namespace=r2")
    assert guessed.returncode == ExitCode.USAGE
    assert "--robot NAME@NAMESPACE" in guessed.stderr

    batch = cli("batch", "--task", "walk", "--robots", "unicycle@r1", "--envs", "hall:1", "--native", "true")
    assert batch.returncode == ExitCode.USAGE
    assert "The robot 'unicycle@r1' is a real one." in batch.stderr


def test_the_doctor_looks_at_one_robot_of_a_fleet(cli: CommandLine) -> None:
    with unicycle(namespace="r2"):
        there, lost = (cli("doctor", "--robot", f"unicycle@{name}") for name in ("r2", "r1"))
    assert "/r2/unicycle listens" in there.stdout + there.stderr
    assert lost.returncode == ExitCode.USAGE
    assert "nothing publishes it (odometry" in lost.stdout + lost.stderr
    assert "did you mean /r2/odom?" in lost.stdout + lost.stderr
