"""Batches of twelve short episodes, to be computed in one place and compared with another."""

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO

from benchbot.plugins.batch.claims import Claim
from tests import conftest
from tests.machines import PATIENCE_S, Machine
from tests.supervisor.harness import eventually

# Whoever imports this has the sample plug-in, and so has every process that they start.
assert conftest.SAMPLE_PLUGIN
BENCHBOT = (sys.executable, "-m", "benchbot")
Start = Callable[[Sequence[str], IO[str]], "subprocess.Popen[str]"]
EPISODES = 12
DOOMED = "node2"
SOLUTION = """\
import json, socket, sys, time
from pathlib import Path
from benchbot.api import ActionResult, Agent, BenchBot

class Patient(Agent):
    def is_done(self, action_result):
        return action_result is not ActionResult.SUCCESS

    def pick_action(self, observations, action_list):
        gate = Path(sys.argv[2]) / "gate"
        if socket.gethostname() == sys.argv[1]:
            gate.touch()
            time.sleep(3600)
        while not gate.exists():
            time.sleep(0.05)
        return "move_next", {}

    def save_result(self, filename, empty_results, results_format_fns):
        Path(filename).write_text(json.dumps(empty_results), "utf-8")

BenchBot(Patient()).run()
"""
"""Does not go on before there is an episode on the doomed machine, and there never: so it is in the middle of one."""


def command(folder: Path, *words: str) -> list[str]:
    """Return the command that computes the batch into a folder; its solution is put into a folder beside it."""
    solution = folder.parent / "solution" / "patient.py"
    solution.parent.mkdir(exist_ok=True)
    solution.write_text(SOLUTION, "utf-8")
    batch = ["--task", "sample:passive", "--robots", "sample_robot", "--envs", "arena:1,arena:2", "--seeds", "0..5"]
    native = ["--native", shlex.join([sys.executable, str(solution), DOOMED, str(folder.parent)])]
    policy = ["--stale-after", "10", "--no-canary"]
    return [*BENCHBOT, "batch", *batch, *native, *policy, "--output-location", str(folder), *words]


def environment(**more: str) -> dict[str, str]:
    """Return the environment in which it runs."""
    return {**os.environ, **more}


def survive(folder: Path, on_cluster: Sequence[str], start: Start, head: Machine, doomed: Machine) -> None:
    """Compute the batch on a cluster, and let it lose its driver and the doomed machine in the middle of it.

    `start` starts a command on the `head` with a file for its stderr. The same command afterwards ends it well: every
    episode has its result, and only what the doomed machine was at was taken over.
    """
    words = command(folder, *on_cluster, "--json")
    with (folder.parent / "driver.log").open("w+") as log:
        driver = start(words, log)
        assert eventually(lambda: is_on_the_doomed_machine(folder), PATIENCE_S)
        (inside,) = head.run("pgrep", "-f", "--", "-m benchbot batch").split()
        head.run("kill", "-9", inside)
        driver.communicate()
        doomed.kill()
        again = start(words, log)
        said, _ = again.communicate(timeout=2 * PATIENCE_S)
        log.seek(0)
        assert again.returncode == 0, log.read()
    assert json.loads(said)["status"]["finished"] == EPISODES
    assert {str(event["worker"]).split("-")[0] for event in told(folder, "stole")} == {DOOMED}


def compute_here(folder: Path) -> Mapping[str, bytes]:
    """Compute the batch on this machine; return its results."""
    words = command(folder, "--jobs", "2")
    subprocess.run(words, check=True, capture_output=True, env=environment(), timeout=2 * PATIENCE_S)
    return results(folder)


def results(folder: Path) -> dict[str, bytes]:
    """Return the bytes of each result that is finished, by its episode's name."""
    return {path.parent.name: path.read_bytes() for path in folder.glob("episodes/*/result.json")}


def working(folder: Path) -> set[str]:
    """Return the names of the workers that hold an episode just now."""
    claims = (Claim.read(path) for path in folder.glob("claims/*"))
    return {claim.worker for claim in claims if claim is not None}


def is_on_the_doomed_machine(folder: Path) -> bool:
    """Say whether a worker there is in the middle of an episode."""
    return (folder.parent / "gate").exists() and any(name.startswith(f"{DOOMED}-") for name in working(folder))


def told(folder: Path, what: str) -> list[dict[str, object]]:
    """Return the events of a kind, of all workers."""
    lines = [line for path in folder.glob("events/*.jsonl") for line in path.read_text("utf-8").splitlines()]
    return [event for event in map(json.loads, lines) if event["what"] == what]
