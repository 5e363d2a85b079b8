import os
import signal
import socket
from urllib.request import urlopen

import pytest

from benchbot.cli.run import summary
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load
from benchbot.core.request import Limits, RunRequest
from benchbot.core.selection import select
from tests.command_line import CommandLine, Here, wait_for

SELECTION = ["--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_run_says_what_it_is_and_where_and_ends_cleanly(number: signal.Signals, cli: CommandLine) -> None:
    process = cli.start("run", *SELECTION, "--seed", "3", "--max-steps", "10", "--port", "0")
    assert process.stderr is not None
    summary = [process.stderr.readline().split(maxsplit=1) for _ in range(7)]
    where = wait_for(process, "Listening")
    wait_for(process, "Ready.")

    os.killpg(process.pid, number)
    stdout, stderr = process.communicate(timeout=60)

    assert ["Task", "sample:passive\n"] in summary
    assert ["Robot", "sample_robot (sim_sample)\n"] in summary
    assert ["Seed", "3\n"] in summary
    assert ["Limits", "10 steps\n"] in summary
    assert "http://127.0.0.1:" in where
    assert process.returncode == 130
    assert stdout == ""
    assert "The back end has ended." in stderr
    assert cli.nothing_is_left()


def test_the_summary_of_a_run_names_its_episode_goal_and_limits() -> None:
    limits = Limits(steps=10, simulated_time_s=2.5, wall_time_s=60.0)
    request = RunRequest("sample:goal", "sample_robot", "arena:1", episode=1, limits=limits)

    lines = dict(line.split(maxsplit=1) for line in summary(select(Catalog(load()), request)))

    assert lines["Episode"] == "1 of 0 to 2, point_goal/arena_1/001: to (1.97, -0.34) m from the start"
    assert lines["Results"] == "any JSON"
    assert lines["Limits"] == "10 steps, 2.5 s of simulated time, 60 s of wall time"


def test_a_run_on_a_unix_socket_listens_nowhere_else(cli: CommandLine) -> None:
    process = cli.start("run", *SELECTION, "--unix-socket", str(cli.home / "s"))

    where = wait_for(process, "Listening")

    assert where.split() == ["Listening", str(cli.home / "s")]
    wait_for(process, "Ready.")
    assert cli("stop").returncode == 0
    assert process.wait(30) == 0
    assert cli.nothing_is_left()


def test_a_run_that_needs_no_token_says_what_that_means(cli: CommandLine) -> None:
    process = cli.start("run", *SELECTION, "--port", "0", "--no-token")

    url = wait_for(process, "Listening").split()[1]
    warning = wait_for(process, "Token")
    hint = wait_for(process, "http_proxy")
    wait_for(process, "Ready.")

    assert "every user and program of this machine can move the robot" in warning
    assert f"http_proxy={url} python my_solution.py" in hint
    with urlopen(f"{url}/robot/is_running", timeout=60) as answer:
        assert answer.read() == b'{"is_running":true}\n'
    assert cli("stop").returncode == 0
    assert process.wait(30) == 0
    assert cli.nothing_is_left()


def test_what_is_set_is_shown_and_checked_before_anything_starts(cli: CommandLine, here: Here) -> None:
    settings = ["--set", "lighting.time=21:30", "--set", "options.tick_sleep_s=0.01"]
    process = cli.start("run", *SELECTION, *settings, "--port", "0")
    assert wait_for(process, "Settings").split(maxsplit=1)[1].strip() == (
        "lighting.time=21:30, options.tick_sleep_s=0.01"
    )
    wait_for(process, "Ready.")
    assert cli("stop").returncode == 0
    process.wait(30)

    for words, message in (
        (["--set", "lighting.tme=21:30"], "unknown key 'tme'. Did you mean 'time'?"),
        (["--set", "start_pose=[]"], "A run cannot set 'start_pose'."),
        (["--set", "assets=toys"], "There is no asset pack 'toys' here."),
        (["--set", "lighting.time"], "--set lighting.time sets nothing."),
    ):
        done = here("run", *SELECTION, *words, "--port", "0")
        assert done.returncode == 2
        assert message in done.stderr


def test_a_port_in_use_is_named_with_the_way_around(cli: CommandLine) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        done = cli("run", *SELECTION, "--port", str(port))

    assert done.returncode == 2
    assert f"Error: Cannot listen on 127.0.0.1:{port}." in done.stderr
    assert "--port 0" in done.stderr
    assert cli.nothing_is_left()


def test_an_impossible_selection_is_told_with_every_reason(here: Here) -> None:
    done = here("run", "-t", "sample:two_scenes", "-r", "carter", "-e", "arena:9", "--port", "0")

    assert done.returncode == 2
    assert "Error: This run is not possible, for 2 reasons." in done.stderr
    assert "1. 'carter' is not a known robot." in done.stderr
    assert "2. 'arena:9' is not a known environment." in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run"], "Missing option '--task'"),
        (["run", *SELECTION, "--port", "99999"], "--port"),
        (["run", *SELECTION, "--max-steps", "0"], "--max-steps"),
        (["run", *SELECTION, "--seed", "-1"], "--seed"),
        (["run", *SELECTION, "--max-wall-time", "soon"], "--max-wall-time"),
        (["run", *SELECTION, "--prot", "0"], "--prot"),
    ],
)
def test_wrong_usage_is_told_by_the_name_of_the_option(words: list[str], message: str, here: Here) -> None:
    done = here(*words)

    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_the_listings_of_v2_keep_their_spelling(here: Here) -> None:
    assert "sample:passive" in here("run", "--list-tasks").stdout
    assert "sample_robot" in here("run", "--list-robots").stdout
    assert "arena:1" in here("run", "--list-envs").stdout
    assert "object_map" in here("run", "--list-formats").stdout
    assert "stops_before_contact" in here("run", "--show-robot", "sample_careful_robot").stdout
    assert "trajectory_poses" in here("run", "--show-environment", "arena:1").stdout
    assert "hello_passive" in here("submit", "--list-examples").stdout
    assert "native_command" in here("submit", "--show-example", "hello_passive").stdout
    assert "omq" in here("eval", "--list-methods").stdout
    assert "OMQ" in here("eval", "--show-method", "omq").stdout
