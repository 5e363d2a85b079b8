"""Ground truths from scenes."""

from pathlib import Path

import pytest

from benchbot.core.declarations import schema
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.ground_truth import ground_truth
from benchbot_scenes.layout import Building, Layout, Placement
from plugins.scenes.tests import packs
from plugins.scenes.tests.plans import WEST

ENVIRONMENT = {"name": "room", "variant": 1, "type": "sim_taichi", "object_labels": ["chair", "couch"]}


def test_objects_with_a_class_of_the_environment_are_listed_with_their_boxes(tmp_path: Path) -> None:
    objects = (
        Placement("chair 1", "chair", (1.0, 2.0, 0.0), yaw_deg=90.0),
        Placement("sofa", "chair", (2.0, 2.0, 0.0), class_name="couch", is_group=True, size_m=(1.0, 2.0, 0.8)),
        Placement("table 1", "table", (3.0, 2.0, 0.0)),
        Placement("stool", "chair", (3.0, 1.0, 0.0), class_name=""),
    )
    layout = Layout("blocks", Building(2.5, 0.3, (WEST,), ()), objects)
    (tmp_path / "scene.glb").write_bytes(compose(layout, {"blocks": packs.pack(tmp_path)}))
    document = ground_truth(load_scene(tmp_path / "scene.glb"), ENVIRONMENT)
    chair, sofa = document["ground_truth"]["objects"]
    assert (chair["class"], chair["ID_name"], chair["isgroup"]) == ("chair", "chair 1", False)
    assert chair["centroid"] == pytest.approx([1.0, 2.0, 0.45])
    assert chair["extent"] == pytest.approx([0.4, 0.5, 0.9])
    assert (sofa["class"], sofa["isgroup"]) == ("couch", True)
    assert sofa["extent"] == pytest.approx([1.0, 2.0, 0.8])
    assert document["ground_truth"]["class_list"] == ["chair", "couch", "background"]
    assert document["ground_truth"]["synonyms"]["sofa"] == "couch"
    assert "television" not in document["ground_truth"]["synonyms"]
    assert document["environment"] == ENVIRONMENT
    schema.check(document, "ground_truth", tmp_path / "truth.json")
