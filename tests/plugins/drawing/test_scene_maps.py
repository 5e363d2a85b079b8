"""Maps of the sample's arenas, and what is on them."""

import json
from pathlib import Path

import pytest

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.drawing import scene_maps
from benchbot.plugins.drawing.map_model import Box, estimated_objects, occupancy_of
from tests.plugins.drawing.test_occupancy import flat


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog(plugin_manager.load())


def test_a_place_has_walls_a_start_and_a_way(catalog: Catalog) -> None:
    found = scene_maps.installed_map(catalog, "arena:1")
    assert found.start_xyyaw is not None
    assert found.start_xyyaw[:2] == (-2.0, 0.0)
    assert len(found.planned) == 3
    # Its floor is not in the format of ROS's map_server.
    assert found.occupancy is None


def test_a_floor_is_as_small_as_what_stands_on_it(tmp_path: Path) -> None:
    floor = occupancy_of(flat(tmp_path))
    assert floor is not None
    assert floor.occupied.tolist() == [[False, False, True], [True, False, False]]
    assert (floor.low, floor.high, floor.resolution_m) == ((-1.0, 2.0), (0.5, 3.0), 0.5)


def test_an_environment_that_is_not_installed_is_refused(catalog: Catalog) -> None:
    with pytest.raises(BenchbotError, match="nowhere"):
        scene_maps.installed_map(catalog, "nowhere:1")
    assert scene_maps.installed_truth(catalog, "nowhere:1") == ()


def test_what_a_result_proposes_is_boxes_and_nonsense_is_none() -> None:
    item = {"centroid": [1, 2, 0.5], "extent": [1, 1, 1], "label_probs": [0.1, 0.9]}
    results = {"objects": [item, {"centroid": [0, 0, 0]}], "class_list": ["cup", "bottle"]}
    (found,) = estimated_objects(results)
    assert (found.label, found.estimated) == ("bottle", Box((1.0, 2.0, 0.5), (1.0, 1.0, 1.0)))
    for nonsense in ({}, None, {"objects": [{**item, "centroid": "here"}]}, [1]):
        assert estimated_objects(nonsense) == []


def test_the_truth_is_there_for_the_host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    truth = {
        "environment": {"name": "arena", "variant": 1},
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {"objects": [{"class": "bottle", "centroid": [0, 0, 0.5], "extent": [1, 1, 1]}]},
    }
    path = tmp_path / "arena_1.json"
    path.write_text(json.dumps(truth))
    monkeypatch.setattr(Catalog, "ground_truth_files", (path,))
    (found,) = scene_maps.installed_truth(Catalog(plugin_manager.load()), "arena:1")
    assert (found.truth_label, found.true) == ("bottle", Box((0.0, 0.0, 0.5), (1.0, 1.0, 1.0)))
    assert scene_maps.installed_map(Catalog(plugin_manager.load()), "arena:1").objects == (found,)
