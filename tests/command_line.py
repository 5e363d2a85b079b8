import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest
import yaml

from benchbot.cli.app import main
from benchbot.core import plugin_manager
from tests.garbage import searched_as_before
from tests.plugin_factory import PluginFactory

COMMAND = [sys.executable, "-m", "benchbot"]
Finished = subprocess.CompletedProcess[str]
Here = Callable[..., Finished]


@dataclass
class CommandLine:
    """Runs `benchbot` in real processes, in a home of their own, with no plug-in but the sample and OMQ."""

    home: Path
    variables: dict[str, str]
    folder: Path
    processes: list["subprocess.Popen[str]"] = field(default_factory=list)

    def __call__(self, *words: str, **changes: str) -> Finished:
        """Run a command to its end."""
        return subprocess.run(
            [*COMMAND, *words],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
            cwd=self.folder,
            env={**self.variables, **changes},
        )

    def start(self, *words: str) -> "subprocess.Popen[str]":
        """Start a command in a process group of its own, as a shell does; it is ended with the test."""
        process = subprocess.Popen(
            [*COMMAND, *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=self.folder,
            env=self.variables,
            process_group=0,
        )
        self.processes.append(process)
        return process

    def script(self, name: str, code: str) -> str:
        """Write a solution; return the command that runs it."""
        path = self.folder / name
        path.write_text(code)
        return f"{sys.executable} {path}"

    def processes_left(self) -> list[str]:
        """Return the command lines of living processes that belong to this home, found by their environment."""
        mark = f"BENCHBOT_STATE_DIR={self.variables['BENCHBOT_STATE_DIR']}".encode()
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit():
                with suppress(OSError):
                    if mark in (entry / "environ").read_bytes() and b"State:\tZ" not in (entry / "status").read_bytes():
                        found.append((entry / "cmdline").read_bytes().replace(b"\0", b" ").decode())
        return found

    def no_process_is_left(self) -> bool:
        """Wait a moment for the last process to vanish; say whether it did."""
        deadline_s = time.monotonic() + 20
        while self.processes_left() and time.monotonic() < deadline_s:
            time.sleep(0.05)
        return self.processes_left() == []

    def nothing_is_left(self) -> bool:
        """Say whether no process, socket and state file is left, a moment later."""
        ended = self.no_process_is_left()
        left = [path for path in self.home.rglob("*") if path.name == "run.json" or path.is_socket()]
        return ended and left == []


@pytest.fixture
def cli(tmp_path: Path) -> Iterator[CommandLine]:
    home, folder = tmp_path / "home", tmp_path / "work"
    home.mkdir()
    folder.mkdir()
    variables = {
        **{name: value for name, value in os.environ.items() if not name.startswith("BENCHBOT_")},
        "BENCHBOT_STATE_DIR": str(home / "state"),
        "BENCHBOT_CACHE_DIR": str(home / "cache"),
        "BENCHBOT_PLUGINS": "benchbot-sample,benchbot-eval-omq",
        "TMPDIR": str(home),
        "COLUMNS": "120",
        "PYTHONFAULTHANDLER": "1",
    }
    command_line = CommandLine(home, variables, folder)
    yield command_line
    for process in command_line.processes:
        kill(process)


def kill(process: "subprocess.Popen[str]") -> str:
    """Kill a command and its group; return what was left of its stderr."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    return process.communicate()[1]


def ended(process: "subprocess.Popen[str]") -> int:
    """Return the exit status of a command that ends by itself; one that hangs fails the test, and says where."""
    try:
        return process.wait(60)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGABRT)
        process.wait(10)
    pytest.fail(f"It hung:\n{kill(process)}")


@pytest.fixture
def here(cli: CommandLine, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Iterator[Here]:
    """Runs `benchbot` like `cli`, but in this process, for commands that start no other: that is much faster."""
    monkeypatch.setenv("BENCHBOT_ADDONS", "")  # `--addons` sets it, which is undone then
    for name in [name for name in os.environ if name.startswith("BENCHBOT_")]:
        monkeypatch.delenv(name)
    for name, value in cli.variables.items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(cli.folder)
    plugin_manager.load.cache_clear()

    def run(*words: str) -> Finished:
        with pytest.raises(SystemExit) as ended:
            main(words)
        out, err = capfd.readouterr()
        return Finished(words, int(ended.value.code or 0), out, err)

    with searched_as_before():
        yield run


@pytest.fixture
def make_plugin(tmp_path: Path, cli: CommandLine) -> Callable[..., Path]:
    """Makes a plug-in distribution that the command line under test finds installed."""
    folder = tmp_path / "site"
    folder.mkdir()
    cli.variables["PYTHONPATH"] = os.pathsep.join([str(folder), cli.variables["PYTHONPATH"]])

    def make(distribution: str, code: str, files: dict[str, str] | None = None) -> Path:
        cli.variables["BENCHBOT_PLUGINS"] += f",{distribution}"
        return PluginFactory(folder).make(distribution, code, files)

    return make


def wait_for(process: "subprocess.Popen[str]", text: str) -> str:
    """Read a process's stderr until a line holds `text`; return the line."""
    assert process.stderr is not None
    seen = []
    for line in process.stderr:
        if text in line:
            return line
        seen.append(line)
    raise AssertionError(f"{text!r} never came: {''.join(seen)}")


SAMPLE = Path(__file__).parent / "sample_plugin" / "benchbot_sample"
BOTTLE = {"centroid": [0, 0, 0.5], "extent": [1, 1, 1]}


def environment(variant: int) -> dict[str, object]:
    declared = yaml.safe_load((SAMPLE / "environments" / f"arena_{variant}.yaml").read_text())
    assert isinstance(declared, dict)
    return declared


@pytest.fixture
def result_folder(cli: CommandLine) -> CommandLine:
    """A folder with a perfect and an empty result of arena:1, a broken one, and the ground truth beside them."""
    truth = {
        "environment": environment(1),
        "format": {"name": "object_map_ground_truth", "functions": {"create": "json:loads"}},
        "ground_truth": {
            "objects": [{"class": "bottle", "ID_name": "b", "isgroup": False, **BOTTLE}],
            "class_list": ["bottle", "background"],
            "synonyms": {},
        },
    }
    (cli.folder / "truth.json").write_text(json.dumps(truth))
    for name, objects in (("perfect", [{"label_probs": [1, 0], **BOTTLE}]), ("empty", []), ("broken", [{}])):
        document = {
            "task_details": yaml.safe_load((SAMPLE / "tasks" / "passive.yaml").read_text()),
            "environment_details": [environment(1)],
            "results": {"class_list": ["bottle", "background"], "objects": objects},
        }
        (cli.folder / f"{name}.json").write_text(json.dumps(document))
    return cli
