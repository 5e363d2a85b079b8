"""Limits from the command line: no reset, no hand-in and no way to hold a solution gives more than an episode has."""

import json
from typing import Any

import pytest

from tests.cli.solutions import RESETTING
from tests.cli.submitted import read
from tests.command_line import CommandLine

ACTIVE = ["--task", "sample:active", "--robot", "sample_robot", "--env", "arena:1"]


@pytest.mark.parametrize("how", ["--native", "--sandbox"])
@pytest.mark.parametrize("words", ["", " hand-in"])
def test_a_reset_does_not_evade_the_limit_of_steps(cli: CommandLine, how: str, words: str) -> None:
    solution = cli.script("resetting.py", RESETTING) + " 0.05" + words
    readable = ["--readable", str(cli.folder)] if how == "--sandbox" else []

    done = cli("submit", how, solution, *readable, *ACTIVE, "--max-steps", "5", "-r", "result.json")

    assert done.returncode == 0, done.stderr
    provenance = read(cli.folder / "result.json")["provenance"]
    assert (provenance["spent"]["steps"], provenance["spent"]["restarts"], provenance["steps"]) == (5, 1, 1)
    assert provenance["failure"]["class"] == "timeout"
    assert "The limit of 5 steps is used up." in done.stderr


def test_who_reads_the_score_is_told_of_the_attempts(result_folder: CommandLine) -> None:
    cli = result_folder
    solution = cli.script("resetting.py", RESETTING) + " 9"  # into the wall, each time

    done = cli("submit", "--native", solution, *ACTIVE, "--record", "steps=steps", "-r", "result.json")
    assert done.returncode == 0, done.stderr
    shown = cli("eval", "result.json", "--ground-truth", "truth.json")
    compared = cli("compare", "a=result.json", "b=result.json", "--ground-truth", "truth.json")
    verified = cli("verify", "result.json", "--ground-truth", "truth.json")

    said = "put back (restarts) in 1 of 1 episodes: arena:1, seed 0: 7 attempts, 6 steps and 6 collisions in all"
    assert said in shown.stderr
    assert "(restarts): a 6 in 1 of 1 results; b 6 in 1 of 1 results." in compared.stderr
    assert "budgets (6 steps, 6 restarts)" in verified.stdout
    assert "not shown by a replay: what the robot did before it was put back (6 restarts)" in verified.stderr
    # A recording is that of the last attempt, which has taken no step.
    rows = [json.loads(line) for line in (cli.folder / "steps" / "steps.jsonl").read_text().splitlines()]
    assert [row["action"] for row in rows] == [None]


def test_a_robot_that_may_not_be_put_back_goes_on_where_it_is(cli: CommandLine) -> None:
    solution = cli.script("resetting.py", RESETTING) + " 0.02"

    done = cli("submit", "--native", solution, *ACTIVE, "--max-restarts", "0", "-r", "result.json")

    assert done.returncode == 0, done.stderr
    assert done.stderr.count("refused: The robot may not be put back again.") == 6
    document = read(cli.folder / "result.json")
    provenance: dict[str, Any] = document["provenance"]
    assert (provenance["steps"], provenance["restarts"], provenance["failure"]) == (24, 0, None)
    assert provenance["selection"]["limits"] == {"restarts": 0}
    assert len(document["actions"][0]["rows"]) == 25


def test_what_cannot_be_enforced_on_a_real_robot_is_refused(cli: CommandLine) -> None:
    real = ["-t", "sample:active", "-r", "sample_real_robot", "-e", "arena:1"]

    done = cli("run", *real, "--max-simulated-time", "60", "--port", "0")

    assert done.returncode == 2
    assert "The robot 'sample_real_robot' has no simulated time that could be limited." in done.stderr
    assert "--max-wall-time SECONDS" in done.stderr
