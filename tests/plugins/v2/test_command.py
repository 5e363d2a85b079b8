import subprocess
import sys

import pytest

from benchbot import __version__
from tests.command_line import CommandLine


def old(cli: CommandLine, function: str, *words: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-c", f"from benchbot.plugins.v2 import command; command.{function}()", *words],
        capture_output=True,
        text=True,
        check=False,
        cwd=cli.folder,
        env=cli.variables,
    )


@pytest.mark.parametrize(
    ("function", "words", "text"),
    [
        ("run", ["--list-tasks"], "sample:passive"),
        ("run", ["--show-task", "sample:passive"], "actions: [move_next]"),
        ("submit", ["--list-examples"], "hello_passive"),
        ("evaluate", ["--list-methods"], "omq"),
        ("evaluate", ["--version"], __version__),
        ("run", ["-v"], __version__),
        ("install", ["--list-addons"], "benchbot-sample"),
        ("install", ["--no-update", "--list-simulators"], "sim_sample"),
    ],
)
def test_the_commands_of_v2_work(function: str, words: list[str], text: str, cli: CommandLine) -> None:
    done = old(cli, function, *words)

    assert done.returncode == 0, done.stderr
    assert text in done.stdout


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["-a", "./no-such,./thing"], "Error: './no-such' is nothing that can be installed."),
        (["--remove-addons=no-such,thing"], "Error: no-such cannot be uninstalled."),
    ],
)
def test_what_benchbot_install_names_is_taken_apart(words: list[str], error: str, cli: CommandLine) -> None:
    done = old(cli, "install", *words)

    assert done.returncode == 2
    assert error in done.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-u"], "-u is gone. Nothing is installed outside the Python environment: pip uninstall benchbot"),
        (["--simulators", "sim_omni"], "--simulators is gone. A simulator is a plug-in: pip install 'benchbot[full]'"),
        (["--branch=develop", "-f"], "--branch is gone. There are no images and no clones to keep in step"),
    ],
)
def test_each_flag_that_is_gone_says_why(words: list[str], said: str, cli: CommandLine) -> None:
    done = old(cli, "install", *words)

    assert done.returncode == 2
    assert done.stderr.startswith(said)
    assert "No such option" not in done.stderr


def test_a_flag_that_is_gone_keeps_the_others_from_nothing(cli: CommandLine) -> None:
    done = old(cli, "install", "--no-update", "--list-simulators")

    assert done.stderr == (
        "--no-update is gone. There are no images and no clones to keep in step: "
        "versions are those that pip has installed.\n"
    )
    assert "sim_sample" in done.stdout


def test_killing_the_controller_is_stopping_the_run(cli: CommandLine) -> None:
    done = old(cli, "run", "--kill-controller")

    assert done.returncode == 2
    assert "No run of yours is there to stop" in done.stderr
