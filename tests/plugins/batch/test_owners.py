"""A batch beside everything else that its user types meanwhile: its results are the bytes that they would have been."""

import json
import subprocess
import sys

from tests.cli.solutions import PASSIVE
from tests.command_line import ended, wait_for
from tests.plugins.batch.conftest import Batches, wait_until

GATED = """\
import pathlib, time
while not pathlib.Path({gate!r}).exists():
    time.sleep(0.05)
"""
"""Does not go on before somebody opens the gate."""


def test_what_is_typed_beside_a_batch_neither_takes_its_robots_nor_counts_against_it(batches: Batches) -> None:
    cli = batches.cli
    # Not where the solution lies: all that is there belongs to it.
    gate = cli.home / "open"
    agent = cli.script("agent.py", PASSIVE)
    gated = Batches(cli, cli.script("gated.py", GATED.format(gate=str(gate)) + PASSIVE))
    gate.touch()
    assert gated.run("undisturbed", "--jobs", "2").returncode == 0
    gate.unlink()
    computing = cli.start(*gated.words("b", "--jobs", "2", "--retries", "0", "--no-canary"))
    wait_until(lambda: gated.told("b", "began") == 2 and len(gated.processes("gated.py")) >= 2)

    submitted = cli("submit", "--native", agent, "-r", "result.json")
    stopped = cli("stop")
    by_hand = subprocess.run(
        [sys.executable, agent.split()[1]],
        cwd=cli.folder,
        env=cli.variables,
        capture_output=True,
        text=True,
        check=False,
    )
    listed = json.loads(cli("tui", "--display", "json").stdout)["runs"]
    run = cli.start("run", "--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1", "--port", "0")
    wait_for(run, "Ready.")
    joined = cli("submit", "--native", agent, "-r", "result.json")
    gate.touch()
    assert ended(computing) == 0
    assert cli("stop").returncode == 0
    assert ended(run) == 0

    assert (submitted.returncode, stopped.returncode) == (2, 2)
    assert by_hand.returncode != 0
    folder = batches.path("b")
    for said in (submitted.stderr, stopped.stderr, by_hand.stderr):
        assert f"of benchbot batch {folder}: sample:passive on sample_robot" in said
    assert {state["owner"] for state in listed} == {f"benchbot batch {folder}"}
    assert joined.returncode == 0, joined.stderr
    assert batches.results("b") == batches.results("undisturbed")
    assert batches.told("b", "began") == 4
    assert "all of them well" in (computing.communicate()[1])
