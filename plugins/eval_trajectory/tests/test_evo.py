"""The same numbers as evo, to 1e-9, for the same files."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_eval_trajectory import comparison
from benchbot_eval_trajectory.alignment import Align
from benchbot_eval_trajectory.association import Association
from benchbot_eval_trajectory.files import FileFormat, text_of
from benchbot_eval_trajectory.trajectory import Trajectory
from plugins.eval_trajectory.tests.evo_parity import differences
from plugins.eval_trajectory.tests.ways import estimate_of, wander


@pytest.mark.parametrize("align", list(Align))
@pytest.mark.parametrize("file_format", list(FileFormat))
@pytest.mark.parametrize("scale", [1.0, 0.2])
def test_all_errors_are_those_of_evo(tmp_path: Path, file_format: FileFormat, align: Align, scale: float) -> None:
    truth = wander(300)
    estimate = estimate_of(truth, scale=scale)
    (tmp_path / "estimate.txt").write_text(text_of(estimate, file_format))
    (tmp_path / "truth.txt").write_text(text_of(truth, file_format))

    for name, ours, theirs in differences(tmp_path / "estimate.txt", tmp_path / "truth.txt", align, 1.0):
        assert ours == pytest.approx(theirs, abs=1e-9, rel=0), name


@pytest.mark.parametrize("align", list(Align))
def test_files_of_few_digits_with_gaps_and_other_clocks_too(tmp_path: Path, align: Align) -> None:
    """As the benchmark's own: four decimals, a truth at 100 Hz, an estimate that begins late and loses poses."""
    truth = wander(900, step_m=0.015)
    truth = Trajectory(truth.positions_m, truth.rotations, 1e5 + np.arange(900) / 100)
    seen = np.sort(np.random.default_rng(3).choice(np.arange(50, 880), 250, replace=False))
    estimate = estimate_of(truth.at(seen))
    assert estimate.times_s is not None
    offsets_s = np.random.default_rng(4).uniform(-0.002, 0.002, len(seen))
    estimate = Trajectory(estimate.positions_m, estimate.rotations, estimate.times_s + offsets_s)
    for name, trajectory in (("estimate", estimate), ("truth", truth)):
        columns = (np.asarray(trajectory.times_s)[:, None], trajectory.positions_m, trajectory.rotations_xyzw)
        np.savetxt(tmp_path / f"{name}.txt", np.hstack(columns), fmt=["%.4f"] * 8, header="a comment")

    found = list(differences(tmp_path / "estimate.txt", tmp_path / "truth.txt", align, 0.5))

    assert ("ATE_m count", 250, 250) in found
    for name, ours, theirs in found:
        assert ours == pytest.approx(theirs, abs=1e-9, rel=0), name


@pytest.mark.parametrize("align", list(Align))
def test_poses_that_crowd_about_those_of_the_truth_too(tmp_path: Path, align: Align) -> None:
    """500 poses a second or so against 100: evo takes several with one, and the benchmark's rule would drop them."""
    truth = wander(900, step_m=0.015)
    truth = Trajectory(truth.positions_m, truth.rotations, np.arange(900) / 100)
    seen = np.sort(np.random.default_rng(5).choice(np.arange(100, 400), 500))
    offsets_s = np.random.default_rng(6).uniform(-0.004, 0.004, len(seen))
    estimate = estimate_of(truth.at(seen))
    times_s = np.sort(seen / 100 + offsets_s)
    estimate = Trajectory(estimate.positions_m, estimate.rotations, times_s)
    (tmp_path / "estimate.txt").write_text(text_of(estimate, FileFormat.TUM))
    (tmp_path / "truth.txt").write_text(text_of(truth, FileFormat.TUM))

    found = list(differences(tmp_path / "estimate.txt", tmp_path / "truth.txt", align, 1.0))

    assert ("ATE_m count", 500, 500) in found
    for name, ours, theirs in found:
        assert ours == pytest.approx(theirs, abs=1e-9, rel=0), name
    by_tum = comparison.compare(estimate, truth, align=align, association=Association.TUM)
    assert by_tum["poses"] < 400
    assert by_tum["unmatched"]["estimate"] == {"poses": 500 - by_tum["poses"], "of": 500}
