"""Batches with the sample plug-in, in real processes."""

import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import benchbot
from benchbot.plugins.batch.source_files import find
from tests.cli.solutions import PASSIVE
from tests.command_line import CommandLine

_PATIENCE_S = 240.0
TELLING = f"""\
import helper
from pathlib import Path
print("content:", helper.CONTENT, open("data.txt").read(), Path(__file__).with_name("data.txt").read_text(), flush=True)
{PASSIVE}"""
"""Prints the content that it is of, from a module and twice from a file."""


@dataclass
class Batches:
    """Runs `benchbot batch` with a solution that follows the trajectory, and looks at what is left in its folder."""

    cli: CommandLine
    solution: str

    def words(self, folder: str, *more: str, seeds: str = "0..1", envs: str = "arena:1,arena:2") -> list[str]:
        """Return the words of a command that computes into `folder`."""
        return [
            *("batch", "--task", "sample:passive", "--robots", "sample_robot", "--envs", envs, "--seeds", seeds),
            *("--native", self.solution, "--output-location", folder, *more),
        ]

    def run(self, folder: str, *more: str, **axes: str) -> Any:
        """Run a batch to its end."""
        return self.cli(*self.words(folder, *more, **axes))

    def path(self, folder: str) -> Path:
        return self.cli.folder / folder

    def results(self, folder: str) -> dict[str, str]:
        """Return each result, by the label of its episode."""
        found = (self.path(folder) / "episodes").glob("*/result.json")
        return {path.parent.name.rpartition("-")[0]: path.read_text("utf-8") for path in found}

    def journals(self, folder: str) -> dict[str, list[dict[str, Any]]]:
        """Return what was noted of the attempts at each episode."""
        found = (self.path(folder) / "episodes").glob("*/attempts.jsonl")
        return {path.parent.name: [json.loads(line) for line in path.read_text("utf-8").splitlines()] for path in found}

    def events(self, folder: str) -> list[dict[str, Any]]:
        """Return what was told so far, oldest first; lines that are being written are left out."""
        found = []
        for path in (self.path(folder) / "events").glob("*.jsonl"):
            for line in path.read_text("utf-8").splitlines():
                with suppress(ValueError):
                    found.append(json.loads(line))
        return sorted(found, key=lambda event: float(event["time_s"]))

    def told(self, folder: str, what: str) -> int:
        """Return how often something was told."""
        return sum(event["what"] == what for event in self.events(folder))

    def processes(self, *words: str) -> list[int]:
        """Return the processes of this test's whose command line holds all the words."""
        mark = f"BENCHBOT_STATE_DIR={self.cli.variables['BENCHBOT_STATE_DIR']}".encode()
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and int(entry.name) != os.getpid():
                with suppress(OSError):
                    line = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                    if mark in (entry / "environ").read_bytes() and all(word in line for word in words):
                        found.append(int(entry.name))
        return sorted(found)


def wait_until(condition: Callable[[], object], patience_s: float = _PATIENCE_S) -> None:
    """Wait for a condition that comes true in the end, on the busiest machine."""
    deadline_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline_s, "it never came true"
        time.sleep(0.02)


class Solution:
    """A solution of three files, which tells what they hold."""

    def __init__(self, batches: Batches) -> None:
        self.folder = batches.cli.folder
        self.batches = batches
        batches.solution = batches.cli.script("s.py", TELLING)
        self.write("one")

    def write(self, content: str) -> str:
        """Edit it, and return its hash."""
        (self.folder / "s.py").write_text(f"# {content}\n{TELLING}")
        (self.folder / "helper.py").write_text(f"CONTENT = {content!r}\n")
        (self.folder / "data.txt").write_text(content)
        return find(self.batches.solution.split(), self.folder).content.hash

    def told(self, folder: str) -> set[tuple[str, str]]:
        """Return the content that each attempt printed, with the snapshot that its result names."""
        found = set()
        for path in (self.folder / folder / "episodes").rglob("result.json"):
            named = json.loads(path.read_text("utf-8"))["provenance"]["solution"]["snapshot"]
            log = (path.parent / "log.txt").read_text("utf-8")
            found |= {(line, named) for line in log.splitlines() if line.startswith("content:")}
        return found


@pytest.fixture(scope="session")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of BenchBot: its hash is in every key, and somebody may edit the sources while tests run."""
    folder = tmp_path_factory.mktemp("sources")
    package = Path(benchbot.__file__).parent
    shutil.copytree(package, folder / package.name, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.fixture
def batches(cli: CommandLine, sources: Path) -> Iterator[Batches]:
    cli.variables["PYTHONPATH"] = os.pathsep.join([str(sources), cli.variables["PYTHONPATH"]])
    yield Batches(cli, cli.script("passive.py", PASSIVE))
    assert cli.no_process_is_left(), cli.processes_left()


@pytest.fixture
def solution(batches: Batches) -> Solution:
    return Solution(batches)
