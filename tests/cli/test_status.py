import os
import pty
import select
import sys
from typing import Any

import pytest

from benchbot.cli.status import StatusLine, progress_text

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
    "failure": None,
    "failure_why": None,
    "ends_run": False,
    "waiting_for": None,
}


def test_progress_is_one_line() -> None:
    assert progress_text(PROGRESS, 2) == (
        "dirty · scene 1/2 · step 12 · pose 12/48 · at (1.25, -0.50) m 90° · 33.2 s simulated · 4.0 s · 3.2 frames/s"
    )


def test_a_hidden_pose_and_an_unused_trajectory_are_left_out_and_a_failure_is_told() -> None:
    progress = {**PROGRESS, "pose_xyyaw": None, "trajectory_index": 0, "failure": "collision"}

    text = progress_text(progress, 1)

    assert " m " not in text
    assert "pose" not in text
    assert text.endswith("failure: collision")


def test_without_a_terminal_only_news_is_printed_and_output_passes_untouched(
    capfd: pytest.CaptureFixture[str],
) -> None:
    with StatusLine() as status:
        status.show("one", news=1)
        status.show("one, later", news=1)
        status.write(b"half a line")
        status.write(b" and the rest\n")

    assert capfd.readouterr().err == "one\nhalf a line and the rest\n"


def test_what_the_operator_is_asked_is_printed_at_once_and_once(capfd: pytest.CaptureFixture[str]) -> None:
    waiting = {**PROGRESS, "waiting_for": "Carry the robot\nto its start."}
    with StatusLine() as status:
        status.show_progress(PROGRESS, 1)
        status.write(b"half a line")
        status.show_progress(waiting, 1)
        status.show_progress({**waiting, "wall_time_s": 5.0}, 1)

    _, half, asked = capfd.readouterr().err.splitlines()
    assert half == "half a line"
    assert asked == ("WAITING FOR YOU: Carry the robot to its start. When it is done, type elsewhere: benchbot ready")


def test_a_safety_stop_is_told_plainly() -> None:
    progress = {**PROGRESS, "failure": "platform", "failure_why": "Too close. The scan says 0.1 m.", "ends_run": True}

    assert progress_text(progress, 1) == "STOPPED FOR SAFETY, the run is over: Too close. The scan says 0.1 m."


def test_on_a_terminal_what_is_urgent_is_a_line_that_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        with StatusLine() as status:
            status.show("busy", news=1)
            status.show("carry it", news=2, urgent=True)
            status.show("carry it", news=2, urgent=True)
        seen = read_until_quiet(ours)
    os.close(ours)

    shown, erased = "\x1b[2m{}\x1b[0m".format, "\r\x1b[K"
    carry = shown("carry it")
    assert seen == f"{shown('busy')}{erased}carry it\r\n{carry}{erased}{carry}{erased}"


def read_until_quiet(terminal: int) -> str:
    """Return what a terminal shows; it passes on what was written to it piece by piece."""
    seen = b""
    while select.select([terminal], [], [], 0.5)[0]:
        seen += os.read(terminal, 4096)
    return seen.decode()


def test_on_a_terminal_the_status_stays_below_the_output(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        with StatusLine() as status:
            status.show("busy", news=1)
            status.write(b"Hello\r\n")
            status.write(b"Which way? ")
            status.show("still busy", news=2)
            status.write(b"left\r\n")
        seen = read_until_quiet(ours)
    os.close(ours)

    shown, erased = "\x1b[2m{}\x1b[0m".format, "\r\x1b[K"
    assert seen == (
        f"{shown('busy')}{erased}Hello\r\r\n{shown('busy')}{erased}Which way? left\r\r\n{shown('still busy')}{erased}"
    )
