"""What is recorded is read back by programs that know nothing of BenchBot: OpenCV's FFmpeg, and Pillow."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from benchbot.core import plugin_manager
from benchbot.core.channels import Observations
from benchbot.core.errors import BenchbotError
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.core.recording import Recording
from benchbot_record_video.boxes import read_segment
from benchbot_record_video.film import FRAMES_PER_S
from benchbot_record_video.fragmented import SEGMENT_FRAMES

FILES = {"video": "video.mp4", "gif": "video.gif"}
HEIGHT, WIDTH = 64, 96
COUNT = 2 * SEGMENT_FRAMES + 7


def image(number: int, width: int = WIDTH) -> NDArray[np.uint8]:
    """A bar that moves to the right, a step a frame: which frame it is can be seen."""
    seen = np.full((HEIGHT, width, 3), (20, 40, 160), np.uint8)
    seen[:, number : number + 8] = (250, 200, 30)
    return seen


def film(recording: Recording, count: int, width: int = WIDTH) -> None:
    for number in range(count):
        seen: Observations = {"image_rgb": image(number, width)}
        step = Step(seen, ActionResult.SUCCESS, (), State.CLEAN, 0)
        recording.step(None, {}, step, Progress(frames=number + 1))


def create(name: str, folder: Path) -> Recording:
    recording: Recording = plugin_manager.load().record("recorders", name).create(folder)
    return recording


def frames(folder: Path, name: str) -> list[NDArray[np.uint8]]:
    path = folder / FILES[name]
    if name == "gif":
        with Image.open(path) as gif:
            return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(gif)]
    reader = cv2.VideoCapture(str(path))
    assert reader.get(cv2.CAP_PROP_FPS) == pytest.approx(FRAMES_PER_S)
    found: list[NDArray[np.uint8]] = []
    while (read := reader.read())[0]:
        found.append(np.asarray(cv2.cvtColor(read[1], cv2.COLOR_BGR2RGB), np.uint8))
    reader.release()
    return found


def follow(shown: list[NDArray[np.uint8]], count: int) -> None:
    """Hold what a film shows against what was filmed, frame by frame."""
    assert len(shown) == count
    for number, frame in enumerate(shown):
        # A codec blurs edges, so the mean tells; where the bar is, it is much redder.
        assert np.abs(frame.astype(float) - image(number)).mean() < 12
        assert abs(int(np.argmax(np.convolve(frame[:, :, 0].mean(0), np.ones(8), "valid"))) - number) <= 1


@pytest.mark.parametrize("name", FILES)
def test_a_film_shows_what_the_camera_saw_and_a_reset_starts_it_over(tmp_path: Path, name: str) -> None:
    recording = create(name, tmp_path)
    recording.reset()
    film(recording, 9)
    recording.reset()
    film(recording, COUNT)
    recording.close()
    recording.close()

    others = {"video": {"video.h264.mp4", "codecs.json"}, "gif": set[str]()}
    assert {path.name for path in tmp_path.iterdir()} == {FILES[name]} | others[name]
    follow(frames(tmp_path, name), COUNT)
    if name == "gif":
        with Image.open(tmp_path / FILES[name]) as gif:
            assert (gif.info["duration"], gif.info["loop"]) == (1000 // FRAMES_PER_S, 0)


KILLED = """
import os, signal, sys
from pathlib import Path
from plugins.record_video.tests.test_films import COUNT, create, film
film(create(sys.argv[1], Path(sys.argv[2])), COUNT)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize(("name", "saved"), [("video", 2 * SEGMENT_FRAMES), ("gif", COUNT)])
def test_what_a_killed_recorder_leaves_plays(tmp_path: Path, name: str, saved: int) -> None:
    done = subprocess.run([sys.executable, "-c", KILLED, name, str(tmp_path)], check=False)
    assert done.returncode == -signal.SIGKILL

    follow(frames(tmp_path, name), saved)


@pytest.mark.parametrize("killed", [False, True])
def test_a_film_is_there_in_h264_as_well(tmp_path: Path, killed: bool) -> None:
    if killed:
        subprocess.run([sys.executable, "-c", KILLED, "video", str(tmp_path)], check=False)
    else:
        recording = create("video", tmp_path)
        film(recording, COUNT, width=WIDTH + 1)  # the format has even sides only
        recording.close()

    with av.open(tmp_path / "video.h264.mp4") as read:
        stream = read.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert int(stream.average_rate or 0) == FRAMES_PER_S
        shown = [np.asarray(frame.to_ndarray(format="rgb24"), np.uint8) for frame in read.decode(stream)]
    assert len(shown) == COUNT if not killed else len(shown) >= SEGMENT_FRAMES
    follow(shown, len(shown))
    made = json.loads((tmp_path / "codecs.json").read_text())
    assert made["video.mp4"].startswith("VP9 (vp09), OpenCV")
    assert made["video.h264.mp4"].startswith("H.264 (libx264), PyAV")


def test_without_an_encoder_there_is_vp9_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    recording = create("video", tmp_path)
    film(recording, 2)
    recording.close()

    assert {path.name for path in tmp_path.iterdir()} == {"video.mp4", "codecs.json"}
    assert [*json.loads((tmp_path / "codecs.json").read_text())] == ["video.mp4"]


def test_a_camera_that_changes_its_size_is_told(tmp_path: Path) -> None:
    recording = create("video", tmp_path)
    film(recording, 3)
    with pytest.raises(BenchbotError, match="cannot be written") as caught:
        film(recording, 1, width=2 * WIDTH)
    assert "(64, 192, 3)" in caught.value.why
    recording.close()

    follow(frames(tmp_path, "video"), 3)


def test_gifs_of_wide_cameras_are_narrow(tmp_path: Path) -> None:
    recording = create("gif", tmp_path)
    film(recording, 2, width=960)
    recording.close()
    with Image.open(tmp_path / "video.gif") as gif:
        assert gif.size == (480, HEIGHT // 2)


@pytest.mark.parametrize("data", [b"", b"\0\0\0\x10ftypisom", b"\0\0\0\x01moov" + 8 * b"\0", b"\0\0\0\x08moov"])
def test_what_is_no_film_is_no_segment(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"box|film"):
        read_segment(data)
