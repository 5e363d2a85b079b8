"""Maps of the sample's arenas, and what is on them."""

import json
from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing.occupancy import occupancy_of
from benchbot.plugins.watching import place
from tests.plugins.drawing.test_floors import flat


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog(plugin_manager.load())


def test_a_place_has_walls_a_start_and_a_way(catalog: Catalog) -> None:
    found = place.place_of(catalog, "arena:1")
    assert found.start_xyyaw is not None
    assert found.start_xyyaw[:2] == (-2.0, 0.0)
    assert len(found.trajectory_xy) == 3
    # Its floor is not in the format of ROS's map_server.
    assert found.occupancy is None


def test_a_floor_is_as_small_as_what_stands_on_it(tmp_path: Path) -> None:
    floor = occupancy_of(flat(tmp_path))
    assert floor is not None
    assert floor.occupied.tolist() == [[False, False, True], [True, False, False]]
    assert (floor.low, floor.high, floor.resolution_m) == ((-1.0, 2.0), (0.5, 3.0), 0.5)


def test_an_environment_that_is_not_installed_is_refused(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="nowhere"):
        place.place_of(catalog, "nowhere:1")
    assert place.truth_of(catalog, "nowhere:1") == ()


def test_what_a_result_proposes_is_boxes_and_nonsense_is_none() -> None:
    item = {"centroid": [1, 2, 0.5], "extent": [1, 1, 1], "label_probs": [0.1, 0.9]}
    result = {"results": {"objects": [item, {"centroid": [0, 0, 0]}], "class_list": ["cup", "bottle"]}}
    (box,) = place.boxes_of(result)
    assert (box.label, box.box.centroid, box.box.extent) == ("bottle", (1.0, 2.0, 0.5), (1.0, 1.0, 1.0))
    for nonsense in ({}, {"results": None}, {"results": {"objects": [{**item, "centroid": "here"}]}}, {"results": [1]}):
        assert place.boxes_of(nonsense) == ()


def test_the_truth_is_there_for_the_host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    truth = {
        "environment": {"name": "arena", "variant": 1},
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {"objects": [{"class": "bottle", "centroid": [0, 0, 0.5], "extent": [1, 1, 1]}]},
    }
    path = tmp_path / "arena_1.json"
    path.write_text(json.dumps(truth))
    monkeypatch.setattr(Catalog, "ground_truth_files", (path,))
    (box,) = place.truth_of(Catalog(plugin_manager.load()), "arena:1")
    assert (box.label, box.box.extent) == ("bottle", (1.0, 1.0, 1.0))
