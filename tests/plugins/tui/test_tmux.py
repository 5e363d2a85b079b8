"""The whole way in a real terminal, by keys: from choosing a run to its score; and runs that outlive their terminal."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

from benchbot.api.client import Client
from benchbot.core import results
from benchbot.wire import run_state

PATIENCE_S = 180.0
COMMAND = [sys.executable, "-P", "-m", "benchbot", "tui"]


def until(condition: Callable[[], bool], what: Callable[[], str]) -> None:
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline_s, what()
        time.sleep(0.1)


class Terminal:
    """A terminal of 100 x 30 cells, in a tmux server of its own; in a folder and with variables, if they are given."""

    def __init__(self, folder: Path, working: Path | None = None, variables: Mapping[str, str] | None = None) -> None:
        self._folder, self._number = folder, 0
        self._working, self._variables = working, variables

    @property
    def _socket(self) -> Path:
        return self._folder / f"s{self._number}"

    def __call__(self, *words: str) -> str:
        tmux = ["tmux", "-u", "-S", str(self._socket), "-f", "/dev/null", *words]
        # Not what readline has put into this process's environment beside Python's: COLUMNS and LINES.
        variables = dict(os.environ if self._variables is None else self._variables)
        done = subprocess.run(
            tmux, capture_output=True, text=True, timeout=60, check=True, env=variables, cwd=self._working
        )
        return done.stdout

    def open(self, *words: str) -> None:
        """Run a command in a new one, which stays when that has ended."""
        self._number += 1
        self("new-session", "-d", "-x", "100", "-y", "30", f"{shlex.join(words)}; echo ended with $?; sleep 1000")

    @property
    def screen(self) -> str:
        """Return the text on the screen."""
        return self("capture-pane", "-p")

    @property
    def painted(self) -> str:
        """Return the text on the screen with its colours."""
        return self("capture-pane", "-p", "-e")

    def sees(self, *texts: str) -> None:
        """Wait until it shows all of these."""
        for text in texts:
            until(lambda text=text: text in self.screen, lambda text=text: f"{text!r} never came:\n{self.screen}")  # type: ignore[misc]

    def press(self, *keys: str) -> None:
        self("send-keys", *keys)

    @property
    def processes(self) -> list[int]:
        """The numbers of the process in it and of its children."""
        first = int(self("list-panes", "-F", "#{pane_pid}"))
        found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(first)], capture_output=True, text=True, check=False)
        return [first, *map(int, found.stdout.split())]

    def close(self) -> None:
        """Close it as a window manager does: whoever is in it gets SIGHUP."""
        subprocess.run(["tmux", "-S", str(self._socket), "kill-server"], capture_output=True, timeout=60, check=False)


@pytest.fixture
def terminal(home: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Terminal]:
    os.environ["LANG"] = os.environ.get("LANG", "C.UTF-8")
    terminal = Terminal(tmp_path_factory.mktemp("t"))
    yield terminal
    terminal.close()


def steps_of(state: run_state.RunState) -> int:
    """Be a solution that takes one step; return how many the run has had since its reset."""
    client = Client(state.connection, PATIENCE_S)
    try:
        client.reset()
        client.step("move_next")
        return int(client.session()["progress"]["steps"])
    finally:
        client.close()


def choose(terminal: Terminal) -> None:
    """Choose the task `sample:passive`, the robot `sample_robot` and the environment `arena:1`."""
    terminal.press("n")
    terminal.sees("sample:passive", "Actions:")
    terminal.press("/")
    terminal.sees("letters of the name")
    terminal.press("passive")
    until(lambda: "sample:goal" not in terminal.screen, lambda: terminal.screen)
    terminal.press("Enter")
    terminal.sees("sample_robot", "walker", "Radius")
    terminal.press("Down", "Down", "Enter")
    terminal.sees("arena:2", "A walled arena")
    terminal.press("Enter")


def test_from_start_to_score_by_keys_and_runs_that_outlive_their_terminal(terminal: Terminal, home: Path) -> None:
    # A run is chosen, with a solution and a method, and watched; its score is told.
    terminal.open(*COMMAND)
    terminal.sees("No run and no batch")
    choose(terminal)
    terminal.sees("Scored by", "omq")
    terminal.press("Enter")
    terminal.sees("hello_active")
    terminal.press("hello_p")
    terminal.press("Enter")
    until(lambda: "hello_active" not in terminal.screen, lambda: terminal.screen)
    terminal.sees("hello_passive")
    terminal.press("C-s")
    terminal.sees("Ended: hello_passive", "OMQ 0.0000")
    terminal.press("Escape")
    terminal.sees("Submitted from here", "OMQ 0.0000")
    found = list((home / "work" / "results").glob("*/result.json"))
    assert len(found) == 1
    assert results.read(found[0])["provenance"]["selection"]["robot"] == "sample_robot"
    assert json.loads(found[0].with_name("scores.json").read_text())["scores"]["OMQ"] == 0.0
    until(lambda: run_state.live() == [], lambda: "The submission's back end is still alive.")

    # A run without a solution goes on when the screens are killed.
    choose(terminal)
    terminal.sees("none yet: wait for one")
    terminal.press("C-s")
    until(lambda: len(run_state.live()) == 1, lambda: f"The run never came:\n{terminal.screen}")
    state = run_state.live()[0]
    terminal.sees("arena:1", "sample_robot")
    for process in terminal.processes[1:]:
        os.kill(process, signal.SIGKILL)
    terminal.sees("ended with 137")
    assert steps_of(state) == 1

    # Other screens find it, and their terminal closes: it still goes on, and can be ended from anywhere.
    terminal.close()
    terminal.open(*COMMAND, "--run", Path(state.folder).name)
    terminal.sees("arena:1", "sample_robot")
    screens = terminal.processes
    terminal.close()
    until(lambda: not any(Path(f"/proc/{process}").exists() for process in screens), lambda: "The screens outlived it.")
    assert steps_of(state) == 1
    stopped = subprocess.run([*COMMAND[:-1], "stop"], capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert stopped.returncode == 0, stopped.stderr
    until(lambda: run_state.live() == [], lambda: "The run is still alive.")
