"""Recordings from the command line: beside a result, of a batch, and of a run that is under way."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from benchbot.api.client import Client
from benchbot.core.recording import RecordingNote, RecordingState
from benchbot.wire.run_state import RunState
from tests.cli.submitted import SELECTION, read
from tests.command_line import CommandLine, ended, wait_for

LOOKS_AROUND = """\
import json, os
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.reset()
benchbot.step("move_next")
seen = [os.path.join(folder, name) for folder, _, names in os.walk(".") for name in names]
with open(benchbot.result_filename, "w") as file:
    json.dump({"results": {"objects": [], "class_list": ["background"]}, "seen": seen}, file)
"""


def steps(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "steps.jsonl").read_text().splitlines()]


def finished(recorder: str, recorded: int) -> RecordingNote:
    return RecordingNote(recorder, RecordingState.FINISHED, recorded)


def test_a_submission_is_recorded_beside_its_result_where_a_sandboxed_solution_sees_nothing_of_it(
    cli: CommandLine,
) -> None:
    words = cli.script("solution.py", LOOKS_AROUND)
    done = cli("submit", "--sandbox", words, *SELECTION, "-r", "result.json", "--record", "steps,trajectory")
    assert done.returncode == 0, done.stderr
    result = read(cli.folder / "result.json")
    folder = cli.folder / "result-recordings"
    assert {name: RecordingNote.read(folder / name) for name in ("steps", "trajectory")} == {
        "steps": finished("steps", 2),
        "trajectory": finished("trajectory", 2),
    }
    assert "Warning" not in done.stderr
    assert "./solution.py" in result["seen"]
    assert [name for name in result["seen"] if "recordings" in name] == []
    assert [line["action"] for line in steps(folder / "steps")] == [None, "move_next"]
    assert cli.nothing_is_left()


BREAKS = """\
import os, shutil
from benchbot.api import BenchBot
benchbot = BenchBot()
benchbot.reset()
shutil.rmtree("result-recordings/frames")
for _ in range(3):
    benchbot.step("move_next")
with open(benchbot.result_filename, "w") as file:
    file.write('{"results": {"objects": [], "class_list": ["background"]}}')
"""


def test_a_recording_that_fails_ends_with_a_warning_and_the_run_goes_on(cli: CommandLine) -> None:
    words = cli.script("solution.py", BREAKS)
    done = cli("submit", "--native", words, *SELECTION, "-r", "result.json", "--record", "frames,steps")
    assert done.returncode == 0, done.stderr
    assert read(cli.folder / "result.json")["provenance"]["failure"] is None
    assert "Warning: There is no whole recording in result-recordings/frames" in done.stderr
    assert RecordingNote.read(cli.folder / "result-recordings" / "steps") == finished("steps", 4)


def test_the_recordings_of_a_batch_are_whole(cli: CommandLine) -> None:
    where = ("--task", "sample:passive", "--robots", "sample_robot", "--envs", "arena:1")
    done = cli(
        "batch", "-o", "batch", *where, "--example", "hello_passive", "--seeds", "0,1", "--record", "steps,frames"
    )
    assert done.returncode == 0, done.stderr
    for episode in (cli.folder / "batch" / "episodes").iterdir():
        count = len(steps(episode / "steps"))
        assert count > 2
        assert RecordingNote.read(episode / "steps") == finished("steps", count)
        assert RecordingNote.read(episode / "frames") == finished("frames", count)


def test_a_run_under_way_is_recorded_from_another_terminal(cli: CommandLine) -> None:
    run = cli.start("run", *SELECTION, "--port", "0", "--record", "steps=whole")
    wait_for(run, "Ready")
    (path,) = (cli.home / "state" / "runs").glob("*/run.json")
    state = RunState.from_dict(json.loads(path.read_text()))
    client = Client(state.connection)
    client.reset()
    client.step("move_next")

    refused = cli("record", "steps", "--run", "another")
    assert (refused.returncode, path.parent.name in refused.stderr) == (2, True)
    assert "is not an installed recorder" in cli("record", "film").stderr

    recording = cli.start("record", "steps,trajectory", "--run", path.parent.name[:6], "-o", "part")
    wait_for(recording, "Ctrl-C finishes it")
    client.step(None)
    client.step("move_next")
    recording.send_signal(signal.SIGINT)
    assert ended(recording) == 0
    out, err = recording.communicate()
    assert out.splitlines() == ["part/steps", "part/trajectory"]
    assert "Warning" not in err
    client.step(None)

    # Another one lasts for as long as the run does, which it also survives being killed of.
    other = cli.start("record", "steps", "-o", "rest")
    wait_for(other, "Ctrl-C finishes it")
    client.step(None)
    client.close()
    os.kill(run.pid, signal.SIGKILL)
    assert ended(other) == 0

    numbers = {
        name: [line["observation"] for line in steps(cli.folder / name)] for name in ("part/steps", "rest/steps")
    }
    assert numbers == {"part/steps": [3, 4], "rest/steps": [6]}
    deadline_s = time.monotonic() + 60
    while RecordingNote.read(cli.folder / "whole") != finished("steps", 6) and time.monotonic() < deadline_s:
        time.sleep(0.05)
    assert RecordingNote.read(cli.folder / "whole") == finished("steps", 6)


def test_there_must_be_a_run_to_record(cli: CommandLine) -> None:
    done = cli("record")
    assert (done.returncode, "No BenchBot run is there" in done.stderr) == (2, True)


def test_recorders_are_listed(cli: CommandLine) -> None:
    found = {entry["name"]: entry["description"] for entry in json.loads(cli("list", "recorders", "--json").stdout)}
    assert {"frames", "steps", "trajectory"} <= found.keys()
    assert all(found.values())


def test_the_route_is_the_hosts(cli: CommandLine) -> None:
    code = "from benchbot.api.client import Client; Client().record()"
    run = cli.start("run", *SELECTION, "--port", "0")
    wait_for(run, "Ready")
    done = subprocess.run(
        [sys.executable, "-c", code], env=cli.variables, cwd=cli.folder, capture_output=True, text=True, check=False
    )
    assert "Only the host" in done.stderr
