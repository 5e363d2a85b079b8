import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.command_line import CommandLine, Here

RUN = ("--task", "sample:passive", "--robot", "sample_robot", "--env", "arena:1")


def test_a_result_is_drawn_with_the_frames_that_were_recorded(
    result_folder: CommandLine,
    here: Here,
) -> None:
    done = result_folder("submit", *RUN, "--example", "hello_passive", "--record", "frames=seen", "-r", "result.json")
    assert done.returncode == 0, done.stderr
    assert len(list((result_folder.folder / "seen").glob("*.jpg"))) > 2

    truth = ("--ground-truth", "truth.json")
    done = here("picture", "result.json", *truth, "--frames", "seen", "-o", "out/with.png")
    assert done.returncode == 0, done.stderr
    assert done.stdout == "out/with.png\n"
    assert here("picture", "result.json", *truth, "-o", "without.png").returncode == 0
    pictures = [np.asarray(Image.open(result_folder.folder / name)) for name in ("out/with.png", "without.png")]
    assert pictures[0].shape == pictures[1].shape
    assert (pictures[0] != pictures[1]).any()


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["missing.json"], "Cannot read missing.json"),
        (["broken.json"], "results.objects[0].label_probs: is missing"),
        (["perfect.json"], "no ground truth of the environment 'arena:1'"),
        (["perfect.json", "--ground-truth", "truth.json", "--frames", "."], "There are no frames in ."),
        (["perfect.json", "--ground-truth", "truth.json", "-o", "picture.odd"], "Cannot write picture.odd"),
    ],
)
def test_what_cannot_be_drawn_is_told(result_folder: CommandLine, here: Here, words: list[str], why: str) -> None:
    done = here("picture", *words)
    assert done.returncode in (1, 2)
    assert why in done.stderr
    assert not Path(result_folder.folder / "picture.png").exists()


@pytest.mark.parametrize("words", ["frames=", "=seen", "frames,steps=seen", "frames,", ""])
def test_a_recording_needs_a_recorder(here: Here, words: str) -> None:
    done = here("submit", *RUN, "--native", "true", "--record", words)
    assert (done.returncode, f"--record {words} cannot be understood" in done.stderr) == (2, True)


def test_a_recorder_must_be_known(here: Here) -> None:
    done = here("submit", *RUN, "--native", "true", "--record", "framse=seen")
    assert (done.returncode, "'framse' is not an installed recorder" in done.stderr) == (2, True)


def test_a_result_that_does_not_say_where_the_robot_was_is_drawn_without_its_way(
    result_folder: CommandLine, here: Here
) -> None:
    document = json.loads((result_folder.folder / "perfect.json").read_text("utf-8"))
    for scene in document["environment_details"]:
        scene.pop("start_pose", None)
        scene.pop("trajectory_poses", None)
    (result_folder.folder / "placeless.json").write_text(json.dumps(document), "utf-8")
    done = here("picture", "placeless.json", "--ground-truth", "truth.json", "-o", "placeless.png")
    assert done.returncode == 0, done.stderr
    assert (result_folder.folder / "placeless.png").exists()
