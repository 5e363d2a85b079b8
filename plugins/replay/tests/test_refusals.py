"""Recordings that cannot be replayed, or do not fit, are refused before anything starts, with reason and fix."""

import shutil
from pathlib import Path

import pytest

from plugins.replay.tests.conftest import Kept, Lab


def mcap(recording: Path) -> Path:
    (file,) = recording.glob("*.mcap")
    return file


def test_a_recording_of_an_active_task_is_refused(lab: Lab) -> None:
    chosen = ["--task", "sample:active", "--robot", "sample_robot", "--env", "arena:1", "--record", "mcap"]
    done = lab("submit", *chosen, "--example", "hello_active", "-r", "active.json")
    assert done.returncode == 0, done.stderr

    done = lab("replay", "active-recordings/mcap", "--native", "true")
    assert done.returncode == 2
    assert "chose where to drive (move_" in done.stderr
    assert "passive task" in done.stderr


def test_an_active_task_cannot_be_run_on_a_recording(lab: Lab, driven: Kept) -> None:
    done = lab("replay", str(driven.recording), "--task", "sample:active", "--native", "true")
    assert done.returncode == 2
    assert "Missing: move_distance, move_angle" in done.stderr


def test_a_task_that_observes_more_than_was_recorded_is_refused(lab: Lab) -> None:
    less = lab.make_task("sample:passive:laser", observations=["laser", "poses"])
    driven = lab.drive("driven", task=less, argument="1")

    done = lab("replay", str(driven.recording), "--task", "sample:passive", "--native", "true")
    assert done.returncode == 2
    assert "Missing: image_rgb, image_rgb_info, image_depth" in done.stderr


def test_a_task_that_observes_less_may_be_replayed(lab: Lab, driven: Kept) -> None:
    less = lab.make_task("sample:passive:laser", observations=["laser", "poses"])
    replayed = lab.replay("replayed", driven.recording, "--task", less)
    (channels,) = {tuple(name for name, _ in seen) for seen in replayed.result["seen"]}
    assert channels == ("laser", "poses", "scene_number")


def test_a_task_with_other_poses_than_those_recorded_is_refused(lab: Lab, driven: Kept) -> None:
    noisy = lab.make_task("sample:passive:noisy", localisation="noisy")
    done = lab("replay", str(driven.recording), "--task", noisy, "--native", "true")
    assert done.returncode != 0
    assert "true ones, and the task is about those of drifting odometry" in done.stderr


@pytest.mark.parametrize("share", [0.0, 0.4, 0.97])
def test_a_truncated_file_is_refused(lab: Lab, driven: Kept, share: float) -> None:
    file = mcap(driven.recording)
    cut = lab.cli.folder / "cut.mcap"
    cut.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])

    done = lab("replay", str(cut), "--native", "true")
    assert done.returncode == 2, done.stderr
    assert "cannot be replayed" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_damaged_file_is_refused(lab: Lab, driven: Kept) -> None:
    data = bytearray(mcap(driven.recording).read_bytes())
    middle = len(data) // 2
    data[middle : middle + 200] = bytes(200)
    damaged = lab.cli.folder / "damaged.mcap"
    damaged.write_bytes(data)

    done = lab("replay", str(damaged), "--native", "true")
    assert done.returncode == 2, done.stderr
    assert "cannot be replayed" in done.stderr


def test_what_is_no_recording_is_refused(lab: Lab) -> None:
    (lab.cli.folder / "text.mcap").write_text("no recording")
    (lab.cli.folder / "empty").mkdir()
    for name, why in (
        ("text.mcap", "cannot be replayed"),
        ("empty", "holds 0 files"),
        ("missing", "There is no such file"),
    ):
        done = lab("replay", name, "--native", "true")
        assert done.returncode == 2, done.stderr
        assert why in done.stderr


def test_another_environment_than_the_recorded_one_is_refused(lab: Lab, driven: Kept) -> None:
    done = lab("replay", str(driven.recording), "--env", "arena:2", "--native", "true")
    assert done.returncode == 2
    assert "was not recorded there" in done.stderr
    assert "There are recordings of: arena:1" in done.stderr


def test_an_environment_that_was_changed_since_is_refused(lab: Lab) -> None:
    place = lab.make("moved:1")
    driven = lab.drive("driven", env=place, argument="1")
    lab.forget()
    shutil.rmtree(lab.cli.folder.parent / "site")
    (lab.cli.folder.parent / "site").mkdir()
    lab.make(place, start_pose=[1, 0, 0, 0, 0.5, 0, 0])

    done = lab("replay", str(driven.recording), "--native", "true")
    assert done.returncode != 0
    assert "is not the environment that was recorded: start_pose differ" in done.stderr


def test_two_recordings_of_one_scene_are_refused(lab: Lab, driven: Kept) -> None:
    copy = shutil.copy(mcap(driven.recording), lab.cli.folder / "copy.mcap")
    chosen = ["--task", "sample:passive", "--robot", "replay", "--env", "arena:1", "--native", "true"]
    done = lab("submit", "--recording", str(driven.recording), "--recording", str(copy), *chosen)
    assert done.returncode == 2
    assert "Two recordings are of 'arena:1'" in done.stderr


def test_an_option_without_a_file_is_refused(lab: Lab) -> None:
    done = lab("list", "robots", "--recording")
    assert done.returncode == 2
    assert "--recording names no file" in done.stderr


def test_a_held_solution_must_not_see_what_it_is_going_to_be_shown(lab: Lab, driven: Kept) -> None:
    done = lab("replay", str(driven.recording), "--sandbox", "true", "--dry-run")
    assert done.returncode == 2
    assert "could read what it is going to be shown" in done.stderr
