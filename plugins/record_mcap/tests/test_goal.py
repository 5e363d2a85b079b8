"""The goal of a navigation episode, as it is recorded."""

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot_record_mcap.recording import McapRecording
from plugins.record_mcap.tests.bags import by_mcap, by_rosbags


@pytest.mark.parametrize(
    ("goal", "recorded"),
    [(np.array([1.0, -0.5]), {"position_xy": [1.0, -0.5]}), ("chair", {"class": "chair"})],
    ids=["point", "object"],
)
def test_a_goal_is_recorded_whether_a_point_or_a_class(
    tmp_path: Path, goal: NDArray[np.float64] | str, recorded: object
) -> None:
    recording = McapRecording(tmp_path / "run")
    recording.step(None, {}, Step({"goal": goal}, ActionResult.SUCCESS, (), State.CLEAN, 0), Progress())
    recording.close()
    for read in (by_rosbags, by_mcap):
        ((_, message),) = read(tmp_path / "run" / "run_0.mcap")["/benchbot/goal"]
        assert json.loads(message.data) == recorded
