"""Pictures are shown in pixels where a terminal answers that it can, and nowhere else."""

import os
import pty
import re
import select
import subprocess
import sys
import termios
import threading
import time
from pathlib import Path

import pytest

from benchbot.plugins.tui import preferences, terminal_answers

KITTY = b"\x1b_Gi=31;OK\x1b\\"


@pytest.mark.parametrize(
    ("answer", "kind"),
    [
        (KITTY + b"\x1b[?62;c", "kitty"),
        (b"\x1b_Gi=31;ENOTSUPPORTED:no\x1b\\\x1b[?62;4;22c", "sixel"),
        (b"\x1b[?62;22;14c", "halfcell"),
        (b"\x1b[?4c", "halfcell"),  # the first number is the terminal's own
        (b"q\x1b[?64;1;4;6c", "sixel"),  # a key was pressed meanwhile
        (b"", "halfcell"),
    ],
)
def test_a_terminal_is_asked_and_its_answer_decides(answer: bytes, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    outside, inside = pty.openpty()
    with os.fdopen(inside, "r+b", buffering=0) as terminal:
        monkeypatch.setattr(sys, "__stdin__", terminal)
        monkeypatch.setattr(sys, "__stdout__", terminal)
        before = termios.tcgetattr(inside)
        asked = bytearray()

        def reply() -> None:
            while not asked.endswith(b"\x1b[c") and select.select([outside], [], [], 5)[0]:
                asked.extend(os.read(outside, 1024))
            os.write(outside, answer)

        thread = threading.Thread(target=reply)
        thread.start()
        assert terminal_answers.kind_of_images(timeout_s=5.0 if answer else 0.2) == kind
        thread.join()
        assert b"a=q" in asked
        assert termios.tcgetattr(inside) == before
    os.close(outside)


def test_what_is_no_terminal_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    with open(os.devnull, "r+b") as nothing:  # noqa: PTH123
        monkeypatch.setattr(sys, "__stdin__", nothing)
        monkeypatch.setattr(sys, "__stdout__", nothing)
        assert terminal_answers.kind_of_images() == "halfcell"


PICTURE = """\
import sys
from PIL import Image
from rich.console import Console
from benchbot.plugins.tui import terminal_answers
kind = terminal_answers.kind_of_images(timeout_s=20.0)
print("kind:", kind)
if kind == "kitty":
    terminal_answers.prepare(kind)
    from textual_image.renderable.tgp import Image as Shown
    Console(color_system="truecolor", force_terminal=True).print(Shown(Image.new("RGB", (8, 8), "red"), 2, 1))
print("it is", "all", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("allowed", [True, False])
def test_within_tmux_pictures_pass_through_to_the_terminal_around_it_where_it_allows_that(
    allowed: bool, tmp_path: Path
) -> None:
    (tmp_path / "conf").write_text(f"set -g allow-passthrough {'on' if allowed else 'off'}\n")
    (tmp_path / "picture.py").write_text(PICTURE)
    tmux = ["tmux", "-u", "-S", str(tmp_path / "s"), "-f", str(tmp_path / "conf")]
    variables = {**os.environ, "TERM": "xterm-256color"}
    variables.pop("TMUX", None)
    outside, inside = pty.openpty()
    command = [*tmux, "new-session", "-x", "80", "-y", "24", f"{sys.executable} {tmp_path / 'picture.py'}"]
    with subprocess.Popen(command, stdin=inside, stdout=inside, stderr=inside, env=variables, start_new_session=True):
        seen, answered = b"", False
        deadline_s = time.monotonic() + 120
        while b"it is all" not in seen:
            assert time.monotonic() < deadline_s, seen
            if select.select([outside], [], [], 0.5)[0]:
                seen += os.read(outside, 1 << 16)
            if b"_Gi=31" in seen and not answered:
                answered = True
                os.write(outside, KITTY)
        subprocess.run([*tmux, "kill-server"], check=False, env=variables)
    os.close(outside)
    os.close(inside)
    assert answered == allowed
    assert f"kind: {'kitty' if allowed else 'halfcell'}".encode() in seen
    # The pixels arrive as the terminal around reads them, and the characters that stand for them where tmux draws.
    transmitted = re.findall(rb"\x1b_G([^;]*);", seen.partition(b"kind:")[2])
    assert bool(transmitted) == allowed
    assert ("\U0010eeee".encode() in seen) == allowed


KEYS = """\
from textual.app import App
from benchbot.plugins.tui import terminal_answers

class Keys(App):
    keys = []
    def on_ready(self):
        self.notify("ready to read")
    def on_key(self, event):
        self.keys.append(event.key)
        if event.key == "q":
            self.exit()

print("kind:", terminal_answers.kind_of_images(timeout_s=0.01))
Keys().run()
print("keys:", *Keys.keys, "all of them")
"""


def test_an_answer_that_comes_too_late_is_not_taken_for_keys() -> None:
    outside, inside = pty.openpty()
    variables = {**os.environ, "TERM": "xterm-kitty"}
    variables.pop("TMUX", None)
    with subprocess.Popen([sys.executable, "-c", KEYS], stdin=inside, stdout=inside, stderr=inside, env=variables):
        os.close(inside)
        seen, late = b"", [b"a" + KITTY[:6], KITTY[6:] + b"\x1b[?62;", b"cb\x1b[6;20;10t", b"\x1b[6~", b"\x1b", b"q"]
        deadline_s = time.monotonic() + 120
        while b"all of them" not in seen:
            assert time.monotonic() < deadline_s, seen
            if select.select([outside], [], [], 0.5)[0]:
                seen += os.read(outside, 1 << 16)
            elif b"ready" in seen and late:
                os.write(outside, late.pop(0))
    os.close(outside)
    assert b"kind: halfcell" in seen
    assert b"keys: a b pagedown escape q all of them" in seen


SLOW_TO_ANSWER = """\
import sys
import time
from benchbot.plugins.tui import command, terminal_answers

def answer_late(asked_for):
    while not hasattr(sys.modules.get("benchbot.plugins.tui.app"), "show"):
        time.sleep(0.01)
    sys.modules["benchbot.plugins.tui.app"].show = lambda **options: print(options["images"])
    return "none"

terminal_answers.way_of_images = answer_late
command.tui(display="screen", images=None, run=None, batch=None, web=False, port=0)
"""


def test_the_screens_are_imported_while_a_terminal_is_slow_to_answer() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", SLOW_TO_ANSWER], capture_output=True, text=True, timeout=120, check=False
    )
    assert ended.stdout == "none\n", ended.stderr


@pytest.mark.parametrize(
    ("kept", "asked_for", "way"),
    [("none", None, "none"), ("none", "halfcell", "halfcell"), ("octant", None, "halfcell"), ("", None, "sixel")],
)
def test_what_is_asked_for_comes_before_the_setting_and_that_before_the_answer(
    kept: str, asked_for: str | None, way: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path))
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setattr(terminal_answers, "kind_of_images", lambda: "sixel")
    # Standard output is no terminal here: one that does not say how wide it draws gets no octants.
    preferences.write("images", kept)
    assert terminal_answers.way_of_images(asked_for) == way


def test_without_colour_no_terminal_is_asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path))
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delattr(terminal_answers, "kind_of_images")
    assert terminal_answers.way_of_images() == "halfcell"
