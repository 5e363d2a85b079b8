"""Log files that grow, burst, shrink, and try to play tricks on a terminal."""

import os
import time
import unicodedata
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.watching.logs import LONGEST_LINE, Logs, harmless, line_of


def test_lines_are_read_as_they_come_and_the_oldest_are_dropped(tmp_path: Path) -> None:
    supervisor, platform = tmp_path / "supervisor.log", tmp_path / "platform.log"
    logs = Logs({"supervisor": supervisor, "platform": platform}, kept=3)
    assert not logs.read()
    supervisor.write_text("2026-01-02 03:04:05,250 WARNING benchbot.supervisor: careful\n2026-01-02 half a li")
    platform.write_text("compiling\nCritical: the floor is gone\n")
    assert logs.read()
    told = [(line.source, line.level, line.text) for line in logs.lines]
    assert told == [
        ("supervisor", "warning", "careful"),
        ("platform", "info", "compiling"),
        ("platform", "error", "Critical: the floor is gone"),
    ]
    assert logs.lines[0].time_s % 1 == 0.25
    with supervisor.open("a") as file:
        file.write("ne\n")
    assert logs.read()
    assert not logs.read()
    # It has no time of its own: that of the line before it in its file.
    assert (logs.lines[0].text, len(logs.lines), logs.dropped) == ("2026-01-02 half a line", 3, 1)
    # Somebody has begun the file anew.
    platform.write_text("0%\r50%\r100%\n")
    assert logs.read()
    assert logs.lines[-1].text == "100%"


def test_of_a_burst_only_the_end_is_read(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_text("".join(f"line {number}\n" for number in range(200_000)))
    logs = Logs({"solution": path})
    assert logs.read()
    assert logs.lines[-1].text == "line 199999"
    assert len(logs.lines) == 1000


@given(st.text() | st.binary().map(lambda data: data.decode("utf-8", "replace")))
def test_no_line_can_do_anything_to_a_terminal(text: str) -> None:
    for shown in (harmless(text), harmless(f"\x1b[31m{text}"), line_of("solution", text).text):
        assert not any(unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp") for letter in shown)
        assert len(shown) <= LONGEST_LINE
    plain = "".join(letter for letter in text if letter.isalnum())[:100]
    assert harmless(f"\x1b[1;31m{plain}\x1b[0m\x1b]0;title\x07") == f"{plain}\\u001b]0;title\\u0007"


def test_lines_are_in_the_order_of_their_times_and_said_in_words(tmp_path: Path) -> None:
    supervisor, solution = tmp_path / "supervisor.log", tmp_path / "solution.log"
    event = (
        "scene_number 0, steps {}, last_action move_next, state dirty, simulated_time_s {}, failure {}, waiting_for {}"
    )
    began_s = time.mktime(time.strptime("2026-01-02 03:00:00", "%Y-%m-%d %H:%M:%S"))
    lines = [
        ("03:00:10", "INFO", "step: " + event.format(1, 2.4999999999999996, None, None)),
        ("03:00:30", "ERROR", "failure: " + event.format(2, None, "collision", None) + "\n    Traceback"),
        ("03:00:40", "INFO", "operator: " + event.format(2, 1.0, None, "Put it back, please.")),
    ]
    supervisor.write_text(
        "".join(f"2026-01-02 {at},000 {level} benchbot.supervisor: {text}\n" for at, level, text in lines)
    )
    solution.write_text("first half\nsecond one\n")
    os.utime(solution, (began_s + 22, began_s + 22))

    logs = Logs({"supervisor": supervisor, "solution": solution}, began_s=began_s)
    assert logs.read()
    assert [(line.text, line.level, line.is_exact, round(line.time_s - began_s)) for line in logs.lines] == [
        ("step 1: move_next · dirty · at 2.50 s", "info", True, 10),
        ("first half", "info", False, 11),
        ("second one", "info", False, 22),
        ("failure, scene 1 · failed: collision · dirty", "error", True, 30),
        ("    Traceback", "error", True, 30),
        ("scene 1, asks the operator: Put it back, please.", "info", True, 40),
    ]
    with supervisor.open("a") as file:
        file.write("2026-01-02 03:00:15,000 INFO benchbot.supervisor: took 0.123456789 s\n")
    assert logs.read()
    late = next(line for line in logs.lines if line.text == "took 0.1235 s")
    assert (logs.lines.index(late), late.number) == (2, 6)
