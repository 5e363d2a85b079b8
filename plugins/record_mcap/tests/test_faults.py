import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

from plugins.record_mcap.tests.bags import by_mcap, by_rosbags

STEPS = """
import json, os, resource, signal, sys
from pathlib import Path
import numpy as np
from benchbot.core.errors import BenchbotError
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot_record_mcap.recording import McapRecording

random = np.random.default_rng(0)

def step(recording, number):
    seen = {"image_rgb": random.integers(0, 256, (40, 60, 3), np.uint8)}  # 7 kB that do not compress
    recording.step("move_next", {}, Step(seen, ActionResult.SUCCESS, (), State.DIRTY, 0),
                   Progress(steps=number, simulated_time_s=float(number)))

folder = Path(sys.argv[1])
"""

KILLED = """
recording = McapRecording(folder)
for number in range(5):
    step(recording, number)
os.kill(os.getpid(), signal.SIGKILL)
"""

FULL = """
told = []
limit = int(sys.argv[2])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
def attempt(call, *arguments):
    try:
        call(*arguments)
    except BenchbotError as error:
        told.append(error.as_dict())
    else:
        told.append(None)
recording = McapRecording(folder)
for number in range(5):
    attempt(step, recording, number)
attempt(recording.close)
print(json.dumps(told))
"""


def run(code: str, *arguments: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, "-c", STEPS + code, *arguments], capture_output=True, text=True, check=False)


@pytest.fixture
def killed(tmp_path: Path) -> Path:
    """The file of a recorder that was killed after five steps."""
    done = run(KILLED, str(tmp_path / "run"))
    assert done.returncode == -signal.SIGKILL, done.stderr
    return tmp_path / "run" / "run_0.mcap"


def test_a_killed_recorder_leaves_a_file_that_every_reader_opens(killed: Path) -> None:
    for read in (by_rosbags, by_mcap):
        bag = read(killed)
        assert [json.loads(message.data)["steps"] for _, message in bag["/benchbot/progress"]] == [0, 1, 2, 3, 4]
        assert len(bag["/camera/color/image_raw"]) == 5


def test_a_file_torn_in_the_middle_of_a_step_holds_the_steps_before(killed: Path) -> None:
    with killed.open("r+b") as file:
        file.truncate(killed.stat().st_size - 1000)
    seen: list[int] = []

    def read_to_the_tear() -> None:
        with killed.open("rb") as stream:
            messages = NonSeekingReader(stream).iter_messages(["/benchbot/progress"], log_time_order=False)
            seen.extend(message.sequence for _, _, message in messages)

    with pytest.raises((McapError, EOFError)):
        read_to_the_tear()
    assert seen == [0, 1, 2, 3]


def test_a_full_disk_is_told_at_once_and_again_and_what_was_written_is_kept(tmp_path: Path) -> None:
    done = run(FULL, str(tmp_path / "run"), "25000")
    assert (done.returncode, done.stderr) == (0, "")
    *steps, close = json.loads(done.stdout)
    written = steps.index(next(filter(None, steps)))
    assert 0 < written < 4
    refused = {
        "title": f"The recording in {tmp_path / 'run'} cannot be written.",
        "why": "File too large.",
        "fix": "Make room, or record into a folder on a disk that has some and that you may write to.",
        "failure": "infrastructure",
    }
    assert steps[written:] == [refused] * (5 - written)
    assert close is None
    for read in (by_rosbags, by_mcap):
        assert len(read(tmp_path / "run" / "run_0.mcap")["/camera/color/image_raw"]) == written
    assert not (tmp_path / "run" / "metadata.yaml").exists()


def test_a_disk_that_has_no_room_for_the_index_is_told(tmp_path: Path) -> None:
    run(KILLED, str(tmp_path / "whole"))
    room = (tmp_path / "whole" / "whole_0.mcap").stat().st_size + 100
    done = run(FULL, str(tmp_path / "run"), str(room))
    *steps, close = json.loads(done.stdout)
    assert steps == [None] * 5
    assert close["title"] == f"The recording in {tmp_path / 'run'} cannot be written."
    assert len(by_rosbags(tmp_path / "run" / "run_0.mcap")["/benchbot/progress"]) == 5


def test_a_disk_that_is_full_from_the_start_is_told_and_leaves_no_file(tmp_path: Path) -> None:
    code = FULL.replace(
        "recording = McapRecording(folder)", "attempt(McapRecording, folder); print(json.dumps(told)); sys.exit()"
    )
    done = run(code, str(tmp_path / "run"), "10")
    (refused,) = json.loads(done.stdout)
    assert refused["why"] == "File too large."
    assert list((tmp_path / "run").iterdir()) == []
