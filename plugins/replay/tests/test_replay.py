"""A recording shows a solution what the robot has seen, to the byte."""

import json
from pathlib import Path
from typing import Any

import pytest

from plugins.replay.tests.conftest import Kept, Lab


@pytest.mark.parametrize(
    ("task", "environment"), [("sample:passive", "arena:1"), ("sample:two_scenes", "arena:1:2")], ids=["one", "two"]
)
def test_a_replay_shows_the_same_bytes_and_leaves_the_same_result(lab: Lab, task: str, environment: str) -> None:
    driven = lab.drive("driven", "--seed", "7", task=task, env=environment)
    replayed = lab.replay("replayed", driven.recording)

    assert len(driven.result["seen"]) > 2
    for key in ("seen", "said", "results", "actions"):
        assert replayed.result[key] == driven.result[key], key
    for one, other in zip(driven.result["track"], replayed.result["track"], strict=True):
        assert (one["source"], other["source"]) == ("simulation", "recording")
        assert one["path_length_m"] == pytest.approx(other["path_length_m"], abs=1e-5)
        # A recording has no rows between observations.
        assert [row for row in one["rows"] if row[0] is not None] == [
            row for row in other["rows"] if row[0] is not None
        ]
    same = ("steps", "frames", "observation_digest", "simulated_time_s", "failure")
    assert all(replayed.provenance[key] == driven.provenance[key] for key in same)
    assert replayed.provenance["selection"]["seed"] == 7


def test_a_result_says_that_it_is_a_replay_and_of_what(lab: Lab, driven: Kept) -> None:
    replayed = lab.replay("replayed", driven.recording)

    said = replayed.provenance["replay"]["arena:1"]
    assert said["robot"] == "sample_robot"
    assert said["steps"] == driven.provenance["steps"]
    assert "replay" not in driven.provenance
    assert replayed.provenance["selection"]["robot"] == "replay"
    assert "Replays " in replayed.said


def test_a_recording_of_a_replay_is_replayed_to_the_same_bytes(lab: Lab, driven: Kept) -> None:
    again = lab.replay("again", driven.recording, "--record", "mcap")
    third = lab.replay("third", again.recording)

    assert third.result["seen"] == driven.result["seen"]
    assert third.provenance["replay"]["arena:1"]["robot"] == "sample_robot"


def test_where_the_recorded_solution_stopped_the_scene_is_at_its_end(lab: Lab) -> None:
    driven = lab.drive("driven", argument="2")
    assert driven.result["said"][-1][0] == "SUCCESS"

    replayed = lab.replay("replayed", driven.recording)
    assert replayed.provenance["failure"] is None
    assert replayed.provenance["steps"] == driven.provenance["steps"]
    assert replayed.result["said"][-1][0] == "FINISHED"
    assert len(replayed.result["environment_details"][0]["trajectory_poses"]) > replayed.provenance["steps"]


def test_a_solution_may_stop_before_the_recording_does(lab: Lab, driven: Kept) -> None:
    replayed = lab.replay("replayed", driven.recording, argument="1")
    assert replayed.provenance["steps"] == 1 < driven.provenance["steps"]


def test_a_collision_is_replayed(lab: Lab) -> None:
    wall = lab.make("bumper:1", trajectory_poses=[[1, 0, 0, 0, 30.0, 0, 0]])
    driven = lab.drive("driven", env=wall)
    assert driven.result["said"][-1] == ["COLLISION", "collided"]

    replayed = lab.replay("replayed", driven.recording)
    assert replayed.result["said"] == driven.result["said"]
    assert replayed.provenance["failure"] == driven.provenance["failure"]
    assert replayed.provenance["failure"]["class"] == "collision"


def test_settings_seed_and_limits_are_as_in_any_run(lab: Lab) -> None:
    driven = lab.drive("driven", "--set", "options.tick_sleep_s=0")
    replayed = lab.replay("replayed", driven.recording, "--seed", "3", "--max-steps", "9")
    chosen = replayed.provenance["selection"]
    assert chosen["settings"] == driven.provenance["selection"]["settings"] == {"options.tick_sleep_s": 0}
    assert (chosen["seed"], chosen["limits"]) == (3, {"steps": 9})


def test_an_environment_that_is_not_installed_is_the_recorded_one(lab: Lab) -> None:
    place = lab.make("elsewhere:1")
    driven = lab.drive("driven", env=place)
    lab.forget()
    assert place not in lab("list", "environments").stdout

    replayed = lab.replay("replayed", driven.recording)
    assert replayed.result["seen"] == driven.result["seen"]
    # What it is evaluated by is not there: whoever has it scores the result.
    assert replayed.result["environment_details"] == driven.result["environment_details"]


def test_what_is_hidden_is_not_in_the_recording(lab: Lab) -> None:
    secret = lab.cli.home / "secret"
    secret.write_text("0123456789abcdef" * 2)
    place = lab.make("vault:1", hidden=True)
    driven = lab.drive("driven", "--secret", str(secret), "--seed", "1234567", env=place)

    (file,) = driven.recording.glob("*.mcap")
    run = run_of(file)
    assert "seed" not in run
    held = json.dumps(run) + (driven.recording / "metadata.yaml").read_text()
    for hidden in (secret.read_text(), "1234567", "map_path", "hidden", "ground_truth_"):
        assert hidden not in held, hidden
    lab.forget()
    replayed = lab.replay("replayed", driven.recording)
    assert replayed.result["seen"] == driven.result["seen"]
    assert "secret" not in replayed.provenance["selection"]


def test_where_the_task_hides_the_true_pose_so_does_the_recording(lab: Lab) -> None:
    task = lab.make_task("sample:passive:noisy", localisation="noisy")
    driven = lab.drive("driven", "--seed", "5", task=task)
    replayed = lab.replay("replayed", driven.recording)

    assert replayed.result["seen"] == driven.result["seen"]
    assert replayed.result["actions"] == driven.result["actions"]
    true = [row[2:] for row in driven.result["track"][0]["rows"]]
    told = json.dumps(progress_of(next(driven.recording.glob("*.mcap"))))
    assert not any(str(x) in told for x, *_ in true[1:])
    # A recording does not know where the robot was: nobody may judge an estimate by where it believed to be.
    assert replayed.result["track"] == []
    done = lab("verify", str(replayed.path), "--recording", str(driven.recording))
    assert "verified" in done.stdout, done.stderr
    assert done.returncode == 0


def run_of(file: Path) -> dict[str, Any]:
    from benchbot_replay.recordings import read

    return dict(read(file).run)


def progress_of(file: Path) -> list[Any]:
    from plugins.record_mcap.tests.bags import by_rosbags

    return [json.loads(message.data) for _, message in by_rosbags(file)["/benchbot/progress"]]
