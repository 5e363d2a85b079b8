"""`benchbot submit --sandbox`: the same results as without, clear words, and nothing left however it ends."""

import json
import os
import signal
import time
from contextlib import suppress
from pathlib import Path

import pytest

from tests.cli.solutions import HANGING, PASSIVE
from tests.cli.submitted import SELECTION, read
from tests.command_line import CommandLine, Here, wait_for
from tests.plugin_factory import DECLARES, PluginFactory

SAMPLE = Path(__file__).parents[2] / "sample_plugin" / "benchbot_sample"
ASKS = """\
import json
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.step("move_next")
with open(benchbot.result_filename, "w") as file:
    json.dump({"results": {"objects": [], "class_list": ["background"]}, "provenance": {"steps": 99}}, file)
"""
"""Claims to have done more than it did."""


def processes_of(script: Path) -> list[str]:
    """Return the numbers of processes that run a script: those in a sandbox have an environment that tells nothing."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if os.fsencode(script) in (entry / "cmdline").read_bytes():
                found.append(entry.name)
    return found


def none_is_left_of(script: Path) -> bool:
    deadline_s = time.monotonic() + 60
    while processes_of(script) and time.monotonic() < deadline_s:
        time.sleep(0.05)
    return processes_of(script) == []


def test_native_and_sandboxed_give_the_same_bytes_but_for_the_mode(cli: CommandLine) -> None:
    words = cli.script("solution.py", PASSIVE)

    native = cli("submit", "--native", words, *SELECTION, "-r", "native.json")
    held = cli("submit", "--sandbox", words, *SELECTION, "-r", "held.json")

    assert (native.returncode, held.returncode) == (0, 0), native.stderr + held.stderr
    assert "The solution runs in a sandbox (bubblewrap)." in held.stderr
    free, kept = read(cli.folder / "native.json"), read(cli.folder / "held.json")
    assert "mode" not in free["provenance"]["solution"]
    assert kept["provenance"]["solution"].pop("mode") == "sandbox"
    assert json.dumps(kept) == json.dumps(free)
    assert cli.nothing_is_left()


def test_a_running_back_end_is_reached_by_its_unix_socket_only(cli: CommandLine) -> None:
    words = cli.script("solution.py", ASKS)
    run = ["run", "-t", "sample:passive", "-r", "sample_robot", "-e", "arena:1", "--port", "0"]
    back_end = cli.start(*run)
    wait_for(back_end, "Ready.")

    refused = cli("submit", "--sandbox", words)
    cli("stop")
    back_end.communicate(timeout=60)
    back_end = cli.start(*run, "--unix-socket", str(cli.folder / "s"))
    wait_for(back_end, "Ready.")
    done = cli("submit", "--sandbox", words, "-r", "result.json")
    owner = (cli.folder / "s").stat().st_uid
    cli("stop")

    assert refused.returncode == 2
    assert "It has no unix socket" in refused.stderr
    assert "benchbot run --unix-socket" in refused.stderr
    assert done.returncode == 0, done.stderr
    assert read(cli.folder / "result.json")["provenance"]["steps"] == 1
    assert owner == os.geteuid()
    assert back_end.wait(60) == 0
    assert cli.nothing_is_left()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_however_submit_ends_the_sandbox_ends_with_it(number: signal.Signals, cli: CommandLine) -> None:
    words = cli.script("solution.py", HANGING)
    process = cli.start("submit", "--sandbox", words, *SELECTION, "-r", "result.json")
    wait_for(process, "hanging")
    before = processes_of(cli.folder / "solution.py")

    os.kill(process.pid, number)
    process.communicate(timeout=60)

    assert len(before) > 1
    assert process.returncode == (-signal.SIGKILL if number == signal.SIGKILL else 130)
    assert cli.no_process_is_left()
    assert none_is_left_of(cli.folder / "solution.py")
    assert not (cli.folder / "result.json").exists()


def test_a_limit_that_was_met_is_told_with_the_option_that_raises_it(cli: CommandLine) -> None:
    words = cli.script("solution.py", "x = [bytearray(b'x' * 2**20) for _ in range(400)]")

    done = cli("submit", "--sandbox", words, "--memory", "150MiB", *SELECTION, "-r", "result.json")

    assert done.returncode == 1
    assert "It used more memory than it may: 150 MiB." in done.stderr
    assert "Give it more with --memory SIZE" in done.stderr
    assert read(cli.folder / "result.json")["provenance"]["failure"]["class"] == "agent"
    assert cli.nothing_is_left()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--native", "true", "--memory", "1GiB"], "A native solution cannot be limited."),
        (["--native", "true", "--readable", "/usr"], "A native solution cannot be limited."),
        (["--sandbox", "true", "--native", "true"], "--native and --sandbox were given."),
        (["--sandbox", "true", "--memory", "much"], "--memory much is no size."),
        (["--sandbox", "true", "--file-size", "0"], "--file-size 0 is no size."),
        (["--sandbox", "true", "--readable", "/nowhere"], "There is no /nowhere."),
    ],
)
def test_what_makes_no_sense_is_refused(words: list[str], message: str, here: Here) -> None:
    done = here("submit", *words)

    assert done.returncode == 2
    assert message in done.stderr


def test_the_home_folder_is_not_shown_to_a_solution(cli: CommandLine) -> None:
    done = cli("submit", "--sandbox", "true", *SELECTION, HOME=str(cli.folder / "home"))

    assert done.returncode == 2
    assert "that holds your home folder" in done.stderr
    assert cli.nothing_is_left()


LOOKS = """\
import os
from benchbot.api import BenchBot
benchbot = BenchBot()
print("models:", os.path.exists({path!r}))
"""


@pytest.mark.parametrize(("readable", "seen"), [("", False), ("readable: [acme-models]", True)])
def test_models_are_seen_when_the_task_says_so(readable: str, seen: bool, cli: CommandLine, tmp_path: Path) -> None:
    site = PluginFactory(tmp_path / "site")
    site.folder.mkdir()
    models = site.make("acme-models", "", {"cup.glb": ""})
    task = (SAMPLE / "tasks" / "passive.yaml").read_text().replace("sample:passive", "acme")
    site.make("acme-task", DECLARES.format(kind="tasks"), {"tasks/acme.yaml": f"{task}{readable}"})
    script = cli.script("solution.py", LOOKS.format(path=str(models / "cup.glb")))

    done = cli(
        *("submit", "--sandbox", script, "--readable", str(site.folder), *SELECTION, "--task", "acme"),
        PYTHONPATH=f"{site.folder}:{os.environ['PYTHONPATH']}",
        BENCHBOT_PLUGINS="benchbot-sample,acme-task",
    )

    assert f"models: {seen}" in done.stderr


def test_a_secret_that_the_solution_would_see_is_refused(cli: CommandLine, tmp_path: Path) -> None:
    inside, outside = cli.folder / "runs.secret", tmp_path / "runs.secret"
    script = cli.script("solution.py", PASSIVE)
    for path, code in ((inside, 2), (outside, 0)):
        path.write_text(16 * "0f")
        done = cli("submit", "--sandbox", script, *SELECTION, "--secret", str(path), "--dry-run")
        assert done.returncode == code, done.stderr
        assert ("The solution could read the secret of its run." in done.stderr) == (code == 2)
