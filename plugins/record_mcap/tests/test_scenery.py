"""Found objects and walls in a recording, as two independent readers see them, and who is not told of walls."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load
from benchbot.evaluation import occupancy_map
from benchbot_record_mcap import scenery
from benchbot_record_mcap.recording import McapRecording
from plugins.record_mcap.tests.bags import Bag, by_mcap, by_rosbags, sample_session

RESULTS = {
    "class_list": ["chair", "cup"],
    "objects": [
        {"label_probs": [0.1, 0.8], "centroid": [1.0, 2.0, 0.8], "extent": [0.1, 0.2, 0.4]},
        {"label_probs": [0.5, 0.2], "centroid": [0.0, 0.0, 0.5], "extent": [1.0, 1.0, 1.0]},
    ],
}


def run_of(*, commitment: str | None = None) -> dict[str, Any]:
    return {
        "task": {"localisation": "ground_truth"},
        "environments": [{"name": "miniroom", "variant": 1}],
        "selection": {"commitment": commitment},
    }


@pytest.mark.parametrize("read", [by_rosbags, by_mcap])
def test_found_objects_are_boxes_with_names_and_the_walls_those_of_the_place(
    tmp_path: Path, read: Callable[[Path], Bag]
) -> None:
    recording = McapRecording(tmp_path / "bag")
    recording.run(run_of())
    recording.result({"results": RESULTS})
    recording.close()
    bag = read(tmp_path / "bag")

    ((_, array),) = bag["/objects"]
    first, *markers = array.markers
    assert first.action == 3  # DELETEALL
    told = [(one.ns, one.id, one.text, (one.pose.position.x, one.pose.position.y)) for one in markers]
    assert told[:2] == [("boxes", 0, "", (1.0, 2.0)), ("names", 0, "cup 0.80", (1.0, 2.0))]
    assert told[3][:3] == ("names", 1, "chair 0.50")
    assert [markers[0].scale.x, markers[0].scale.y, markers[0].scale.z] == [0.1, 0.2, 0.4]
    assert all(one.header.frame_id == "map" and one.type in (1, 9) for one in markers)

    ((_, grid),) = bag["/map"]
    declared = Catalog(load()).get("environments", "miniroom:1")
    plan = occupancy_map.read(occupancy_map.map_file(declared.data, declared.path.parent))
    cells = np.array(grid.data, np.int8).reshape(grid.info.height, grid.info.width)
    np.testing.assert_array_equal(cells[::-1] == 100, plan.occupied)
    np.testing.assert_array_equal(cells[::-1] == 0, plan.free)
    assert (grid.info.origin.position.x, grid.info.origin.position.y) == plan.origin_xyyaw[:2]


def test_nothing_of_the_walls_is_written_before_the_end_or_where_there_is_a_secret(tmp_path: Path) -> None:
    for name, commitment in (("open", None), ("secret", "ab" * 32)):
        recording = McapRecording(tmp_path / name)
        recording.run(run_of(commitment=commitment))
        recording.result({"results": RESULTS})
        assert "/map" not in by_mcap(tmp_path / name)  # the robot still drives
        recording.close()
        assert ("/map" in by_mcap(tmp_path / name)) == (commitment is None)


def test_a_hidden_place_is_never_told(monkeypatch: pytest.MonkeyPatch) -> None:
    declared = Catalog(load()).get("environments", "miniroom:1")
    assert scenery.walls(run_of(), 1) is not None
    monkeypatch.setitem(declared.data, "hidden", True)
    monkeypatch.setattr(Catalog, "find", lambda *_: declared)

    assert scenery.walls(run_of(), 1) is None


@pytest.mark.parametrize("results", [None, {}, {"poses": []}, {"objects": [{"x": 1}]}, {"objects": 3}])
def test_results_of_another_kind_have_no_markers(tmp_path: Path, results: Any) -> None:
    recording = McapRecording(tmp_path / "bag")
    session = sample_session(recording)
    session.reset()
    recording.result({"results": results})
    session.close()
    recording.close()

    assert "/objects" not in by_mcap(tmp_path / "bag")
