import json
import pkgutil
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from benchbot import __version__
from benchbot.cli.app import EVERYDAY
from benchbot.core import entry_points
from benchbot.core.light_records import Command
from tests.command_line import COMMAND, CommandLine, Here

COMMANDS = [*EVERYDAY, *entry_points.shipped("commands")]
HEAVY = ["numpy", "taichi", "rclpy", "textual", "jsonschema", "httpx", "starlette", "pydantic", "rich"]

IMPORTED = """\
import atexit, json, sys
atexit.register(lambda: print(json.dumps(sorted(sys.modules)), file=sys.stderr))
from benchbot.cli.app import main
main({words!r})
"""

COMMAND_OF_PLUGIN = """\
from benchbot.plugin import hookimpl
from benchbot.plugin import Command

@hookimpl
def benchbot_commands():
    yield Command({name!r}, {target!r}, "Do something.")
"""


def test_help_names_every_command_and_exit_code(cli: CommandLine) -> None:
    done = cli("--help")

    assert done.returncode == 0
    assert done.stderr == ""
    for command in COMMANDS:
        assert f"  {command.name}" in done.stdout
        assert command.help.split(",")[0] in done.stdout
    for code in ("0 ", "1 ", "2 ", "3 ", "4 ", "130"):
        assert f"\n    {code}" in done.stdout


@pytest.mark.parametrize("command", COMMANDS, ids=[command.name for command in COMMANDS])
def test_every_command_in_the_box_exists_and_explains_itself(command: Command, here: Here) -> None:
    pkgutil.resolve_name(command.target)

    done = here(command.name, "--help")

    assert done.returncode == 0
    assert f"Usage: benchbot {command.name}" in done.stdout
    assert here(command.name, "-h").stdout == done.stdout


@pytest.mark.parametrize("words", [(), ("list", "tasks"), ("plugins", "list"), ("batch", "run"), ("batch", "status")])
def test_h_is_help_everywhere(words: tuple[str, ...], here: Here) -> None:
    done = here(*words, "-h")

    assert done.returncode == 0
    assert done.stdout == here(*words, "--help").stdout
    assert "-h, --help" in done.stdout


def test_benchbot_alone_ends_with_a_first_run_that_works_as_typed(cli: CommandLine) -> None:
    told = cli().stderr
    _, _, offered = told.partition("A first run, ")
    words = shlex.split(offered.partition("\n")[2].replace("\\\n", " "))
    del cli.variables["BENCHBOT_PLUGINS"]  # with all that is installed

    done = cli(*words[1:], "--dry-run")

    assert words[:2] == ["benchbot", "submit"]
    assert done.returncode == 0, done.stderr


def test_version(here: Here) -> None:
    assert here("--version").stdout == f"benchbot {__version__}\n"


def test_an_unknown_command_is_a_usage_error_with_the_nearest_name(here: Here) -> None:
    done = here("sumbit")

    assert done.returncode == 2
    assert done.stdout == ""
    assert "No such command 'sumbit'. Did you mean 'submit'?" in done.stderr


@pytest.mark.parametrize("words", [["--help"], ["list", "tasks"], ["plugins", "list"]])
def test_what_must_start_fast_imports_nothing_heavy(words: list[str], cli: CommandLine) -> None:
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED.format(words=words)],
        capture_output=True,
        text=True,
        check=True,
        env=cli.variables,
    )

    modules = set(json.loads(done.stderr))
    assert [name for name in HEAVY if name in modules] == []


def test_listing_plugins_imports_none_of_them(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    make_plugin("explosive", "raise SystemExit('imported')")

    done = cli("plugins", "list", "--json")

    assert done.returncode == 0
    assert {"name": "explosive", "module": "explosive", "distribution": "explosive", "version": "1.2"} in json.loads(
        done.stdout
    )


def test_a_plugin_adds_a_command(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    make_plugin(
        "greeter",
        COMMAND_OF_PLUGIN.format(name="greet", target="greeter.command:greet"),
        {"command.py": "def greet(name: str) -> None:\n    print(f'Hello {name}')\n"},
    )

    assert cli("greet", "you").stdout == "Hello you\n"
    assert "greet" in [line.split()[0] for line in cli("list", "commands").stdout.splitlines()]
    assert "Did you mean 'greet'" in cli("gret").stderr


def test_a_plugin_cannot_take_the_name_of_a_command(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    make_plugin("usurper", COMMAND_OF_PLUGIN.format(name="run", target="usurper:run"))

    done = cli("anything")

    assert done.returncode == 2
    assert "Two commands are called 'run'." in done.stderr
    assert "Both 'benchbot' and 'usurper' provide it" in done.stderr


FAIL = """\
def fail(interrupt: bool = False) -> None:
    raise KeyboardInterrupt if interrupt else 1 / 0
"""


@pytest.fixture
def failing(cli: CommandLine, make_plugin: Callable[..., Path]) -> CommandLine:
    make_plugin(
        "failing",
        COMMAND_OF_PLUGIN.format(name="fail", target="failing.command:fail"),
        {"command.py": FAIL},
    )
    return cli


def test_an_unforeseen_error_is_an_internal_error_without_traceback(failing: CommandLine) -> None:
    done = failing("fail")

    assert done.returncode == 3
    assert "Internal error" in done.stderr
    assert "ZeroDivisionError: division by zero" in done.stderr
    assert "benchbot -v" in done.stderr
    assert "Traceback" not in done.stderr


def test_verbose_shows_the_traceback(failing: CommandLine) -> None:
    done = failing("-v", "fail")

    assert done.returncode == 3
    assert "Traceback (most recent call last)" in done.stderr


def test_an_interrupted_command_exits_with_130(failing: CommandLine) -> None:
    assert failing("fail", "--interrupt").returncode == 130


INTERRUPTS_ITSELF = """\
import os, signal, sys

class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["INTERRUPTED_AT"]:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupt())
"""


@pytest.mark.parametrize("module", ["typer", "benchbot.cli.app", "benchbot.cli.evaluate", "jsonschema", "numpy"])
def test_a_command_that_is_interrupted_while_it_imports_exits_with_130(
    module: str, result_folder: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "sitecustomize.py").write_text(INTERRUPTS_ITSELF)
    path = f"{tmp_path}:{result_folder.variables['PYTHONPATH']}"

    done = result_folder("eval", "perfect.json", "--ground-truth", "truth.json", PYTHONPATH=path, INTERRUPTED_AT=module)

    assert done.returncode == 130
    assert "Traceback" not in done.stderr


def test_a_user_error_is_a_title_a_reason_and_a_fix(here: Here) -> None:
    done = here("show", "task", "sample:pasive")

    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr == (
        "Error: 'sample:pasive' is not a known task.\n"
        "\n"
        "  Known: sample:active, sample:goal, sample:lost, sample:noisy, sample:passive, sample:two_scenes. "
        "Did you mean 'sample:passive'?\n"
        "\n"
        "  Fix: List them with: benchbot list tasks\n"
    )


def test_a_full_disk_behind_stdout_is_said(cli: CommandLine) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*COMMAND, "list", "tasks"], stdout=full, stderr=subprocess.PIPE, text=True, env=cli.variables, check=False
        )

    assert done.returncode == 3
    assert "Error: Cannot write to the standard output." in done.stderr
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_reader_that_has_seen_enough_is_no_error(cli: CommandLine) -> None:
    process = cli.start("list", "environments", "--json")
    assert process.stdout is not None
    process.stdout.close()

    assert process.wait(60) == 0
    assert process.stderr is not None
    assert process.stderr.read() == ""
