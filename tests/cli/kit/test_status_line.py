import json
import os
import pty
import select
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TextIO

import pytest

from benchbot.cli.kit.status_line import Display, StatusLine, progress_text

PROGRESS: dict[str, Any] = {
    "state": "dirty",
    "scene_number": 0,
    "steps": 12,
    "trajectory_index": 12,
    "trajectory_length": 48,
    "last_action": "move_next",
    "pose_xyyaw": [1.25, -0.5, 1.5707963],
    "simulated_time_s": 33.25,
    "wall_time_s": 4.0,
    "frames": 13,
    "spent": {"steps": 12, "restarts": 0},
    "failure": None,
    "failure_why": None,
    "ends_run": False,
    "waiting_for": None,
    "paused": False,
}


def test_progress_is_one_line() -> None:
    assert progress_text(PROGRESS, 2) == (
        "dirty · scene 1/2 · step 12 · pose 12/48 · at (1.25, -0.50) m 90° · 33.2 s simulated · 4.0 s · 3.2 frames/s"
    )


def test_the_time_of_a_real_robot_is_not_called_simulated() -> None:
    progress = {key: value for key, value in PROGRESS.items() if key != "simulated_time_s"}
    text = progress_text({**progress, "robot_time_s": 33.25}, 2)
    assert "33.2 s by the robot's clock · 4.0 s" in text
    assert "simulated" not in text


def test_the_attempts_before_count() -> None:
    spent = {"steps": 24, "restarts": 5}
    assert "step 12 (24 in 6 attempts)" in progress_text({**PROGRESS, "spent": spent}, 1)


def test_a_hidden_pose_and_an_unused_trajectory_are_left_out_and_a_failure_is_told() -> None:
    hidden = {"pose_xyyaw": None, "simulated_time_s": None}
    progress = {**PROGRESS, **hidden, "trajectory_index": 0, "failure": "collision"}

    text = progress_text(progress, 1)

    assert " m " not in text
    assert "pose" not in text
    assert "simulated" not in text
    assert text.endswith("failure: collision")


def test_without_a_terminal_only_news_is_printed_and_whose_a_line_is(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with StatusLine() as status:
        status.show("one", news=1)
        status.show("one, later", news=1)
        status.write(b"half a line")
        status.write(b" and the rest\n")

    assert capfd.readouterr().err == "one\nsolution | half a line and the rest\n"


def test_what_the_operator_is_asked_is_printed_at_once_and_once(capfd: pytest.CaptureFixture[str]) -> None:
    waiting = {**PROGRESS, "waiting_for": "Carry the robot\nto its start."}
    with StatusLine() as status:
        status.show_progress(PROGRESS, 1)
        status.write(b"half a line")
        status.show_progress(waiting, 1)
        status.show_progress({**waiting, "wall_time_s": 5.0}, 1)

    _, half, asked = capfd.readouterr().err.splitlines()
    assert half == "solution | half a line"
    assert asked == ("WAITING FOR YOU: Carry the robot to its start. When it is done, type elsewhere: benchbot ready")


def test_a_safety_stop_is_told_plainly() -> None:
    progress = {**PROGRESS, "failure": "platform", "failure_why": "Too close. The scan says 0.1 m.", "ends_run": True}

    assert progress_text(progress, 1) == "STOPPED FOR SAFETY, the run is over: Too close. The scan says 0.1 m."


def test_a_pause_is_told() -> None:
    assert progress_text({**PROGRESS, "paused": True}, 1).startswith("PAUSED · dirty · ")
    assert progress_text({**PROGRESS, "frames": 0, "paused": True}, 1) == "PAUSED · nothing observed yet"


def test_what_keeps_the_first_observation_waiting_is_told() -> None:
    preparing = {**PROGRESS, "frames": 0, "preparing": "the simulator builds a tree"}
    assert progress_text(preparing, 1) == "nothing observed yet · the simulator builds a tree"


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator["Terminal"]:
    monkeypatch.setenv("TERM", "xterm-256color")
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as file:
        yield Terminal(ours, file)
    os.close(ours)


@dataclass(frozen=True)
class Terminal:
    screen: int
    file: TextIO

    def line(self, display: Display = "auto") -> StatusLine:
        """Return a status line whose stderr is this terminal."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "stderr", self.file)
            return StatusLine(display)

    def shown(self, until: str) -> str:
        """Return what it shows next, up to a text that it is sure to show."""
        seen = b""
        while until.encode() not in seen and select.select([self.screen], [], [], 60)[0]:
            seen += os.read(self.screen, 65536)
        return seen.decode()


def test_on_a_terminal_what_is_urgent_is_a_line_that_stays(terminal: Terminal) -> None:
    with terminal.line() as status:
        status.show("busy", news=1)
        assert terminal.shown(until=dim("busy")) == dim("busy")
        status.show("carry it", news=2, urgent=True)
        status.show("carry it", news=2, urgent=True)
        assert terminal.shown(until=dim("carry it")) == f"{ERASED}carry it\r\n{dim('carry it')}"
    assert terminal.shown(until=ERASED) == ERASED


def test_on_a_terminal_the_status_stays_below_the_output(terminal: Terminal) -> None:
    with terminal.line() as status:
        status.show("busy", news=1)
        terminal.shown(until=dim("busy"))
        status.write(b"Hello\r\n")
        assert terminal.shown(until=dim("busy")) == f"{ERASED}solution | Hello\r\n{dim('busy')}"
        status.write(b"Which way? ")
        assert terminal.shown(until="way? ") == f"{ERASED}solution | Which way? "
        status.show("still busy", news=2)
        status.write(b"left\r\n")
        assert terminal.shown(until=dim("still busy")) == f"left\r\n{dim('still busy')}"


@pytest.mark.parametrize(("variable", "value"), [("TERM", "dumb"), ("display", "plain")])
def test_a_terminal_that_can_rewrite_nothing_gets_lines(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch, variable: str, value: str
) -> None:
    monkeypatch.setenv(variable, value)
    with terminal.line("plain" if variable == "display" else "rich") as status:
        status.show("busy", news=1)
        status.show("busier", news=2)
        status.write(b"Hello\n")
    assert terminal.shown(until="Hello\r\n") == "busy\r\nsolution | Hello\r\n"


def test_without_colour_the_line_is_still_rewritten(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    with terminal.line() as status:
        status.show("busy", news=1)
        assert terminal.shown(until="busy") == "busy"
    assert terminal.shown(until=ERASED) == ERASED


def test_a_terminal_that_takes_nothing_holds_nobody_up(terminal: Terminal) -> None:
    """As after Ctrl-S: more is printed than the terminal has room for, and nothing is read from it."""
    with terminal.line() as status:
        for number in range(2000):
            status.show_progress({**PROGRESS, "frames": number}, 1)
            status.write(b"x" * 1023 + b"\n")
        # Nobody has waited. When the terminal is let go on, it is told what it has missed.
        seen = terminal.shown(until="the terminal did not take them]")
    assert 0 < seen.count("x" * 1023) < 2000


def test_json_lines_and_nothing_at_all(capfd: pytest.CaptureFixture[str]) -> None:
    with StatusLine("json") as status:
        status.show_progress(PROGRESS, 2)
        status.write("Grüße\n".encode())
        status.show_progress({**PROGRESS, "waiting_for": "Carry it."}, 2)
    progress, output, asked = (json.loads(line) for line in capfd.readouterr().err.splitlines())
    assert progress == {"kind": "progress", "scene_count": 2, **PROGRESS}
    assert output == {"kind": "output", "text": "Grüße\n"}
    assert asked["waiting_for"] == "Carry it."

    with StatusLine("none") as status:
        status.show_progress(PROGRESS, 1)
        status.write(b"what the solution prints\n")
        status.show_progress({**PROGRESS, "waiting_for": "Carry it."}, 1)
    assert capfd.readouterr().err.splitlines()[1:] == [progress_text({**PROGRESS, "waiting_for": "Carry it."}, 1)]


def test_output_to_a_pipe_is_never_lost() -> None:
    """A pipe is read to its end, however slowly: what is printed waits for it."""
    words = "import sys\nfrom benchbot.cli.kit.status_line import StatusLine\n"
    words += "with StatusLine() as line:\n    for _ in range(4000): line.write(b'y' * 999 + b'\\n')\n"
    with subprocess.Popen([sys.executable, "-c", words], stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        assert process.stderr.read().count(b"y") == 4000 * 999
    assert process.returncode == 0


ERASED = "\r\x1b[K"


def dim(text: str) -> str:
    return f"\x1b[2m{text}\x1b[0m"
