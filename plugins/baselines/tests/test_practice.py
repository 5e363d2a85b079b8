"""Places to practise driving in, made for real: two small ones."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchbot.plugin import BenchbotError
from benchbot_baselines import practice
from benchbot_task_navigation.floor_plan import FloorPlan
from benchbot_task_navigation.ways import Ways, length_m

CARTER_RADIUS_M = 0.30


def test_a_place_knows_how_far_it_is_to_each_goal_from_anywhere(tmp_path: Path) -> None:
    practice.main(["--seeds", "2001-2002", "--episodes", "4", "--processes", "1", "--output", str(tmp_path)])

    course, other = practice.courses(tmp_path)
    assert (course.environment, other.environment) == ("practice2001:1", "practice2002:1")
    listed = json.loads((tmp_path / "practice2001" / "episodes" / "practice2001_1.json").read_text("utf-8"))
    truth = json.loads(
        (tmp_path / "practice2001" / "ground_truths" / "floor_plan_practice2001_1.json").read_text("utf-8")
    )
    ways = Ways(FloorPlan.from_ground_truth(truth["ground_truth"]), CARTER_RADIUS_M)
    for episode, distances_m in zip(listed["episodes"], course.distances_m, strict=True):
        start = np.array(episode["start_pose"][4:6])
        way = ways.between(tuple(start), tuple(episode["goal"]["position"][:2]))
        assert way is not None
        assert length_m(way) == pytest.approx(episode["shortest_path_m"], abs=1e-3)
        i, j = np.rint((start - course.origin_xy) / course.resolution_m).astype(int)
        # Along a grid, and from its next node, a way is a little longer, and never much shorter.
        assert 0.97 <= distances_m[i, j] / episode["shortest_path_m"] <= 1.08
    assert np.isfinite(course.distances_m).all()


def test_seeds_of_places_that_count_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        practice.main(["--seeds", "7", "--output", str(tmp_path)])

    assert "The place of the seed 7 is not to be trained in." in capsys.readouterr().err


def test_a_folder_without_places_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="no place to practise"):
        practice.courses(tmp_path)
