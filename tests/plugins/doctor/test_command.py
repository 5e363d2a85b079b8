import json
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

from tests.command_line import CommandLine, Here

DECLARES_TASKS = """\
from importlib.resources import files
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_tasks():
    yield files(__name__) / "tasks"
"""

SIMULATOR = """\
from benchbot.plugin import hookimpl
from benchbot.plugin import Simulator

def warm(cache_dir):
    {warm}

@hookimpl
def benchbot_simulators():
    yield Simulator("sim_slow", lambda spec: None, warm)
"""


DRIVER = """\
from benchbot.plugin import hookimpl
from benchbot.core.findings import Finding, Level
from benchbot.core.errors import BenchbotError
from benchbot.plugin import RobotDriver

def diagnose(spec):
    yield Finding(Level.OK, "topic /scan", f"10.0 Hz, for {{spec.robot['name']}}")
    {then}

@hookimpl
def benchbot_robot_drivers():
    yield RobotDriver("seen", lambda spec: None, diagnose)

@hookimpl
def benchbot_robots():
    from importlib.resources import files
    yield files(__name__) / "robots"
"""
ROBOT = """\
name: seen_robot
type: seen
global_frame: map
robot_frame: base_link
poses: [base_link]
connections: {laser: {connection: ros_to_api}}
"""


def findings(cli: CommandLine, *words: str) -> dict[str, dict[str, str]]:
    return {finding["subject"]: finding for finding in json.loads(cli("doctor", "--json", *words).stdout)}


def test_a_sound_installation_is_called_sound(cli: CommandLine) -> None:
    done = cli("doctor")

    assert done.returncode == 0
    assert "ok       plug-in sample: benchbot-sample 1.0" in done.stdout
    assert "ok       names: no two plug-ins use the same one" in done.stdout


def test_all_that_a_run_depends_on_is_looked_at_and_what_is_not_well_has_a_fix(cli: CommandLine) -> None:
    told = findings(cli)

    assert {
        *("Python", "command", "versions", "plug-in formats", "names", "tasks", "simulator sim_sample", "GPU", "ROS 2"),
        *(
            "containers",
            "sandbox",
            "machine",
            "cache folder",
            "state folder",
            "data folder",
            "temporary files",
            "cache",
        ),
        *("shared memory", "clock", "port 10000"),
    } <= set(told)
    assert [finding for finding in told.values() if (finding["level"] == "ok") == bool(finding["fix"])] == []


def test_a_plugin_that_does_not_load_is_told_with_cause_and_fix(
    cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    make_plugin("broken", "import no_such_module")

    done = cli("doctor")

    assert done.returncode == 2
    assert "broken   plug-in broken: broken 1.2 cannot be loaded: ModuleNotFoundError: No module named" in done.stdout
    assert "Fix: pip install --force-reinstall broken" in done.stdout
    assert done.stderr.startswith("1 broken")  # a warning may follow: another program may use the default port


def test_a_name_that_is_given_twice_is_told_with_both_givers(
    cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    make_plugin(
        "twin",
        DECLARES_TASKS,
        {"tasks/a.yaml": 'name: "sample:active"\nactions: [move_next]\nobservations: [laser]\n'},
    )

    finding = findings(cli)["tasks"]

    assert finding["level"] == "broken"
    assert "Both 'benchbot-sample' and 'twin' provide it" in finding["detail"]


def test_a_declaration_that_is_not_valid_is_told_with_file_and_line(
    cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    package = make_plugin(
        "sloppy", DECLARES_TASKS, {"tasks/a.yaml": "name: a\nactions: [fly]\nobservations: [laser]\n"}
    )

    finding = findings(cli)["task"]

    assert finding["level"] == "broken"
    assert finding["detail"].startswith(f"{package}/tasks/a.yaml:2: 'fly' is not allowed here.")
    assert finding["fix"].startswith("Mend it, then run: benchbot check ")


@pytest.mark.parametrize(
    ("warm", "level", "detail"),
    [
        ("return 'compiled 12 kernels'", "ok", "compiled 12 kernels"),
        ("raise OSError('no such driver')", "broken", "it cannot start: OSError: no such driver"),
    ],
)
def test_warming_starts_every_simulator(
    warm: str, level: str, detail: str, cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    make_plugin("slow", SIMULATOR.format(warm=warm))

    cold = findings(cli)["simulator sim_slow"]
    warmed = findings(cli, "--warm")["simulator sim_slow"]

    assert cold["level"] == "ok"
    assert (warmed["level"], warmed["detail"]) == (level, detail)


@pytest.mark.parametrize(
    ("then", "code", "last"),
    [
        ("pass", 0, None),
        ("yield Finding(Level.WARNING, 'clock', '80 ms late', 'Use NTP.')", 0, ("warning", "clock", "Use NTP.")),
        ("yield Finding(Level.BROKEN, 'e-stop', 'no answer', 'Plug it in.')", 2, ("broken", "e-stop", "Plug it in.")),
        ("raise BenchbotError('No node.', 'Silence.', 'Start it.')", 2, ("broken", "robot seen_robot", "Start it.")),
        ("1 / 0", 2, ("broken", "robot seen_robot", "Report it to the author of seeing.")),
    ],
)
def test_a_real_robot_is_looked_at_by_its_driver(
    then: str, code: int, last: tuple[str, str, str] | None, cli: CommandLine, make_plugin: Callable[..., Path]
) -> None:
    make_plugin("seeing", DRIVER.format(then=then), {"robots/seen.yaml": ROBOT})

    done = cli("doctor", "--robot", "seen_robot", "--json")

    scan, *others = json.loads(done.stdout)
    assert done.returncode == code
    assert "Traceback" not in done.stderr
    assert scan == {"level": "ok", "subject": "topic /scan", "detail": "10.0 Hz, for seen_robot", "fix": ""}
    assert [(finding["level"], finding["subject"], finding["fix"]) for finding in others] == ([last] if last else [])


@pytest.mark.parametrize(
    ("words", "title"),
    [
        (["--robot", "sample_robot"], "The robot 'sample_robot' is simulated."),
        (["--robot", "sample_real_robot"], "The robot 'sample_real_robot' cannot be looked at."),
        (["--robot", "sample_robbot"], "'sample_robbot' is not a known robot."),
        (["--robot", "sample_real_robot", "--warm"], "--warm and --robot do not go together."),
    ],
)
def test_a_robot_that_nobody_can_look_at_is_told_in_words(words: list[str], title: str, here: Here) -> None:
    done = here("doctor", *words)

    assert done.returncode == 2
    assert f"Error: {title}" in done.stderr
    assert done.stdout == ""


def test_a_robot_without_a_driver_is_told_what_to_install(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    code = "from importlib.resources import files\nfrom benchbot.plugin import hookimpl\n\n@hookimpl\n"
    make_plugin(
        "lonely", code + "def benchbot_robots():\n    yield files(__name__) / 'robots'\n", {"robots/a.yaml": ROBOT}
    )

    done = cli("doctor", "--robot", "seen_robot")

    assert done.returncode == 2
    assert "Error: No driver for the robot 'seen_robot' is installed." in done.stderr
    assert "Installed drivers: real_sample." in done.stderr
    assert "benchbot install benchbot-robot-seen" in done.stderr


def test_a_port_that_somebody_else_uses_is_a_warning_with_a_way_out(cli: CommandLine) -> None:
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        with suppress(OSError):  # then it is in use already
            other.bind(("127.0.0.1", 10000))
            other.listen()
        finding = findings(cli)["port 10000"]

    assert finding["level"] == "warning"
    assert "--port 0" in finding["fix"]


def test_a_state_folder_that_cannot_be_written_is_broken(cli: CommandLine) -> None:
    done = cli("doctor", BENCHBOT_STATE_DIR="/proc/no_such_folder")

    assert done.returncode == 2
    assert "broken   state folder: /proc/no_such_folder: No such file or directory" in done.stdout
    assert "Fix: Make it writable, or name another folder in BENCHBOT_STATE_DIR." in done.stdout
