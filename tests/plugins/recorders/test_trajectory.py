"""The files of `trajectory` are read by evo."""

import math
from pathlib import Path

import numpy as np
from evo.tools import file_interface
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.core.channels import Observations
from benchbot.core.geometry import Pose
from benchbot.core.progress import ActionResult, Progress, State, Step
from benchbot.plugins.recorders.trajectory import TrajectoryRecording

numbers = st.floats(-1e4, 1e4)
places = st.tuples(st.floats(1e-3, 1e3), numbers, numbers, st.floats(-math.pi, math.pi))


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(places, min_size=1, max_size=8))
def test_evo_reads_back_where_the_robot_was_and_was_said_to_be(
    tmp_path: Path, steps: list[tuple[float, float, float, float]]
) -> None:
    recording = TrajectoryRecording(tmp_path)
    recording.reset()
    times_s = np.cumsum([duration_s for duration_s, *_ in steps])
    for time_s, (_, x, y, yaw_rad) in zip(times_s, steps, strict=True):
        told: Observations = {"poses": {"base_link": Pose.planar(y, x, -yaw_rad).record("map")}}
        progress = Progress(simulated_time_s=float(time_s), pose_xyyaw=(x, y, yaw_rad))
        for _ in range(2):  # looked at twice in one place
            recording.step(None, {}, Step(told, ActionResult.SUCCESS, (), State.DIRTY, 0), progress)
    assert not (tmp_path / "true.tum").exists()
    recording.close()

    true = file_interface.read_tum_trajectory_file(tmp_path / "true.tum")
    observed = file_interface.read_tum_trajectory_file(tmp_path / "observed.tum")
    np.testing.assert_array_equal(true.timestamps, times_s)
    np.testing.assert_array_equal(observed.timestamps, times_s)
    np.testing.assert_array_equal(true.positions_xyz, [(x, y, 0) for _, x, y, _ in steps])
    np.testing.assert_array_equal(observed.positions_xyz, [(y, x, 0) for _, x, y, _ in steps])
    half_rad = np.array([yaw_rad / 2 for *_, yaw_rad in steps])
    np.testing.assert_allclose(
        true.orientations_quat_wxyz[:, [0, 3]], np.stack([np.cos(half_rad), np.sin(half_rad)], 1)
    )
    (tmp_path / "true.tum").unlink()
