"""Recordings in their own process: everything arrives, nothing waits, and what goes wrong ends the recording alone."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, Unpack, cast

import numpy as np
import pytest

from benchbot.core.channels import OBSERVATIONS, Observations
from benchbot.core.digest import ObservationDigest
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.core.motion import Outcome
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.core.recording import RecordingNote, RecordingState, problems
from benchbot.plugins.authoring.conformance.fake_robot import fake_observations
from benchbot.supervisor.recording.host import RecorderHost
from tests.supervisor.harness import children_of, eventually

PATIENCE_S = 60


def step(number: int, **observations: Unpack[Observations]) -> tuple[str, dict[str, Any], Step, Progress]:
    """The step with a number, from 1; the robot goes 0.1 m in each."""
    base = Pose.planar(0.1 * number, 0.0, 0.0)
    seen = observations or fake_observations(OBSERVATIONS, base, np.random.default_rng(number))
    taken = Step(seen, ActionResult.SUCCESS, ("move_distance",), State.DIRTY, 0, Outcome.REACHED)
    progress = Progress(State.DIRTY, frames=number, steps=number, simulated_time_s=0.5 * number, pose_xyyaw=(9, 9, 1))
    return "move_distance", {"distance": 0.1}, taken, progress


def lines(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "steps.jsonl").read_text().splitlines()]


def test_what_is_told_arrives_as_it_was_in_all_recordings(tmp_path: Path) -> None:
    ended: list[str] = []
    folders = {name: tmp_path / name for name in ("steps", "frames", "trajectory")}
    host = RecorderHost(folders, ended.append)
    host.reset()
    host.step(*step(1))
    host.reset()
    told = [step(number) for number in range(1, 7)]
    for one in told:
        host.step(*one)
        # What it was given may be overwritten at once, as an arena is.
        one[2].observations["image_rgb"][:] = 0
    host.close()
    host.close()

    assert ended == []
    read = lines(folders["steps"])
    assert [line["observation"] for line in read] == [1, 2, 3, 4, 5, 6]
    for number, line in enumerate(read, 1):
        digest = ObservationDigest()
        digest.update(step(number)[2].observations)
        assert line["sha256"] == digest.hexdigest()
        assert (line["action"], line["outcome"], line["result"]) == ("move_distance", "reached", "SUCCESS")
        # A solution may read this file: the true pose is not in it, nor in the one that is written as it goes.
        assert line["pose"]["translation_xyz"] == pytest.approx([0.1 * number, 0, 0])
    assert "9.0 9.0" not in (folders["trajectory"] / "observed.tum").read_text()
    assert (folders["trajectory"] / "true.tum").read_text().count("9.0 9.0") == 6
    assert len(list(folders["frames"].glob("*.jpg"))) == 6
    for name, folder in folders.items():
        assert RecordingNote.read(folder) == RecordingNote(name, RecordingState.FINISHED, recorded=6)
    assert problems(folders) == []
    assert host.pid not in children_of(os.getpid())


def test_channels_of_a_platform_of_its_own_are_recorded_too(tmp_path: Path) -> None:
    made, arrived = (cast(Any, step(1)[2].observations) | {"sonar": {"ranges_m": np.arange(4.0)}} for _ in range(2))
    host = RecorderHost({"steps": tmp_path}, print)
    host.reset()
    host.step(*step(1, **made))
    host.close()
    expected = ObservationDigest()
    expected.update(arrived)
    assert lines(tmp_path)[0]["sha256"] == expected.hexdigest()


def test_an_observation_that_cannot_be_sent_is_refused_and_an_empty_one_is_not(tmp_path: Path) -> None:
    host = RecorderHost({"steps": tmp_path}, print)
    host.reset()
    host.step(*step(1, laser={"scans": np.empty((0, 2)), "range_min": 0.0, "range_max": cast(float, np.float32(3))}))
    with pytest.raises(BenchbotError, match="cannot be recorded"):
        host.step(*step(2, image_rgb=cast(Any, object())))
    with pytest.raises(BenchbotError, match="cannot be recorded"):
        host.step(*step(2, image_rgb=np.array(["text"])))
    host.step(*step(3, goal="chair"))
    host.close()
    assert [line["observation"] for line in lines(tmp_path)] == [1, 3]


def test_a_step_for_which_there_is_no_room_is_dropped_counted_and_told(tmp_path: Path) -> None:
    folder = tmp_path / "steps"
    ended: list[str] = []
    host = RecorderHost({"steps": folder}, ended.append, queue_bytes=3 * 2**20)
    host.reset()
    host.step(*step(1))
    child = host.pid
    assert eventually(lambda: len(lines(folder)) == 1, PATIENCE_S)
    os.kill(child, signal.SIGSTOP)  # a disk that does not answer
    picture = np.zeros((2**20,), np.uint8)
    for number in range(2, 12):
        host.step(*step(number, image_rgb=picture))
    assert host.dropped == 8
    os.kill(child, signal.SIGCONT)
    assert eventually(lambda: len(lines(folder)) == 3, PATIENCE_S)
    host.step(*step(12))
    host.close()

    assert [line["observation"] for line in lines(folder)] == [1, 2, 3, 12]
    assert RecordingNote.read(folder) == RecordingNote("steps", RecordingState.FINISHED, recorded=4, dropped=8)
    (told,) = problems({"steps": folder})
    assert told.startswith("8 of 12 steps were not recorded")
    assert ended == []


def test_a_recording_that_fails_ends_alone_with_a_message(tmp_path: Path) -> None:
    ended: list[str] = []
    folders = {"frames": tmp_path / "frames", "steps": tmp_path / "steps"}
    host = RecorderHost(folders, ended.append)
    host.reset()
    # A picture that no JPEG can hold.
    host.step(*step(1, image_rgb=np.zeros((1, 70_000, 3), np.uint8)))
    for path in (tmp_path / "frames").glob("*"):
        path.unlink()
    (tmp_path / "frames").rmdir()
    host.step(*step(2))
    host.step(*step(3))
    host.close()

    assert len(ended) == 1
    assert [line["observation"] for line in lines(folders["steps"])] == [1, 2, 3]


def test_a_recorder_that_is_killed_harms_nobody(tmp_path: Path) -> None:
    ended: list[str] = []
    host = RecorderHost({"steps": tmp_path}, ended.append)
    host.reset()
    host.step(*step(1))
    assert eventually(lambda: len(lines(tmp_path)) == 1, PATIENCE_S)
    os.kill(host.pid, signal.SIGKILL)

    def noticed() -> bool:
        host.step(*step(2))
        return host.ended

    assert eventually(noticed, PATIENCE_S)
    host.close()

    assert len(ended) == 1
    assert "SIGKILL" in ended[0]
    assert len(lines(tmp_path)) == 1
    (told,) = problems({"steps": tmp_path})
    assert "was not finished" in told
    assert host.pid not in children_of(os.getpid())


KILLED = """
import os, signal, sys
from pathlib import Path
from tests.supervisor.recording.test_host import step
from benchbot.supervisor.recording.host import RecorderHost
host = RecorderHost({"steps": Path(sys.argv[1]), "mcap": Path(sys.argv[2])}, print)
host.reset()
for number in range(1, 30):
    host.step(*step(number))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_supervisor_has_observed_is_written_to_the_end(tmp_path: Path) -> None:
    folders = {"steps": tmp_path / "steps", "mcap": tmp_path / "bag"}
    done = subprocess.run([sys.executable, "-c", KILLED, *map(str, folders.values())], check=False)
    assert done.returncode == -signal.SIGKILL

    finished = [RecordingNote(name, RecordingState.FINISHED, recorded=29) for name in folders]
    assert eventually(lambda: [RecordingNote.read(folder) for folder in folders.values()] == finished, PATIENCE_S)
    assert len(lines(folders["steps"])) == 29
    # Its index is written last of all.
    assert (folders["mcap"] / "metadata.yaml").is_file()


def test_a_recording_that_cannot_begin_is_told_at_once(tmp_path: Path) -> None:
    before = {*children_of(os.getpid())}
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(BenchbotError, match="cannot be written"):
        RecorderHost({"steps": tmp_path / "steps", "frames": tmp_path / "file" / "frames"}, print)
    with pytest.raises(BenchbotError, match="not an installed recorder"):
        RecorderHost({"film": tmp_path / "film"}, print)
    assert {*children_of(os.getpid())} <= before
