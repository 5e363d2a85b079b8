"""What is made before a command starts anything."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.submitted import SELECTION
from tests.command_line import CommandLine

TOWNS = """
from pathlib import Path
from benchbot.core.long_work import under_way
from benchbot.plugin import EnvironmentSet, hookimpl

FOLDER = Path(__file__).parent

def make(number):
    with (FOLDER / "told.txt").open("a") as file:
        file.write(f"{number} {[str(loop) for loop in under_way]}\\n")
    folder = FOLDER / "made" / str(number)
    (folder / "environments").mkdir(parents=True, exist_ok=True)
    about = f"name: town_{number}\\nvariant: 1\\ntype: sim_sample\\n"
    about += "start_pose: [1, 0, 0, 0, -2, 0, 0]\\ntrajectory_poses: [[1, 0, 0, 0, -1, 0, 0]]\\n"
    (folder / "environments" / f"town_{number}_1.yaml").write_text(about)
    return folder

@hookimpl
def benchbot_environment_sets():
    yield EnvironmentSet("town", 3, make)
"""


@pytest.mark.parametrize("command", ["submit", "batch"])
def test_environments_of_a_set_are_counted_while_they_are_made(
    command: str, cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    module = make_plugin("acme-towns", TOWNS)
    places = ("1", "2", "3") if command == "batch" else ("1",)
    environments = ",".join(f"town_{number}:1" for number in places)
    done = cli(command, *SELECTION[:-1], environments, "--example", "hello_passive", "--dry-run")

    assert done.returncode == 0, done.stderr
    told = next(module.parent.rglob("told.txt")).read_text().splitlines()
    assert [line.partition(" ")[0] for line in told] == list(places)
    assert told[0] == f"1 ['Making environments: 0 of {len(places)}']"
