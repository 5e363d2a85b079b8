"""Scans with the labels that their data sets ship: what becomes of them, and what is refused."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from benchbot.api import Agent, Observations
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.plugins.examples.hello_passive import PassiveAgent
from benchbot.plugins.formats import object_map, object_map_ground_truth
from benchbot_eval_omq import omq
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing.environment import build, ground_truth, write
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.labels import class_of
from benchbot_scenes.importing.understanding import Understood, convert, digest, understand
from benchbot_scenes.importing.vocabulary import CLASSES
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.visibility import CARTER
from benchbot_task_semslam.examples.segmentation_mapper import SegmentationMapper
from plugins.scenes.tests.importing import scanned
from plugins.scenes.tests.importing.places import trimesh
from plugins.scenes.tests.importing.scanned import FORMATS, ROOM, TRUTH
from tests.plugins.mapping import casting

HAVE_BOXES = {"ScanNet++", "3RScan", "Replica", "Matterport3D", "labels.json"}


def _truth(understood: Understood) -> list[dict[str, Any]]:
    declaration = {"name": "room", "variant": 1, "object_labels": list(CLASSES)}
    objects: list[dict[str, Any]] = ground_truth(understood.geometry, declaration, understood.labelled)["ground_truth"][
        "objects"
    ]
    return objects


def _label(name: str) -> str:
    return name.rstrip("0123456789() ").replace("-", " ")


@pytest.mark.parametrize("title", FORMATS)
def test_every_format_gives_objects_classes_boxes_and_the_object_of_each_triangle(title: str, tmp_path: Path) -> None:
    understood = understand(FORMATS[title](tmp_path), Guesses())
    found = _truth(understood)
    assert [entry["class"] for entry in found] == [box.class_name for box in TRUTH.values()]
    for entry, box in zip(found, TRUTH.values(), strict=True):
        low, high = box.bounds
        assert entry["centroid"] == pytest.approx((low + high) / 2, abs=1e-4)
        assert entry["extent"] == pytest.approx(high - low, abs=1e-4)
        if title in HAVE_BOXES:
            assert sorted(entry["oriented_box"]["extent"]) == pytest.approx(sorted(box.size), abs=1e-4)
            assert entry["oriented_box"]["centroid"] == pytest.approx(box.middle, abs=1e-4)
    assert ("oriented_box" in found[0]) == (title in HAVE_BOXES or title == "labels.csv")
    labelled = understood.labelled
    assert labelled is not None
    assert labelled.format == {
        "labels.json": "boxes",
        "labels.csv": "boxes",
        "Matterport3D region": "Matterport3D",
    }.get(title, title)

    # Each triangle is of the box that its middle is on; scans have the order of their mesh no more.
    geometry = understood.geometry
    middles = geometry.vertices[geometry.triangles].mean(axis=1)
    names = np.array(["", *(_label(found.name) for found in geometry.instances)])[geometry.triangle_instance]
    for box in TRUTH.values():
        own = names == box.label
        local = np.abs((middles[own] - box.middle) @ box.turn) / (np.array(box.size) / 2)
        assert np.abs(local.max(axis=1) - 1).max() < 1e-3
        # Where two boxes touch, either may have the triangles; one in a list leaves to the floor what lies on it.
        least = {"labels.json": 0.75, "labels.csv": 0.75}.get(title, 0.99)
        assert own.sum() >= least * 2 * len(scanned.quads_of(box)[1])


def _observed(scene: SceneGeometry, pose: Sequence[float]) -> Observations:
    """What a camera of the robot at a pose of its base sees, by rays of Embree."""
    heading = 2 * math.atan2(pose[3], pose[0])
    camera = Pose.planar(pose[4], pose[5], heading, z=CARTER.eye_m) @ casting.OPTICAL
    v, u = np.mgrid[0 : casting.HEIGHT, 0 : casting.WIDTH]
    rays = np.stack([u - casting.WIDTH / 2, v - casting.HEIGHT / 2, np.full(u.shape, casting.FOCAL)], -1)
    rays = rays.reshape(-1, 3) / casting.FOCAL @ camera.matrix()[:3, :3].T
    origin = camera.matrix()[:3, 3]
    mesh = trimesh.Trimesh(scene.vertices, scene.triangles, process=False)
    hit = mesh.ray.intersects_first(np.tile(origin, (len(rays), 1)), rays)
    corners = scene.vertices[scene.triangles[hit]].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    depth = ((corners[:, 0] - origin) * normal).sum(1) / (rays * normal).sum(1)
    number_of = {name: number for number, name in enumerate(CLASSES, start=1)}
    classes = np.array([0, *(number_of.get(found.class_name or "", 0) for found in scene.instances)])
    seen = np.where(hit >= 0, scene.triangle_instance[hit], 0)
    shape = casting.HEIGHT, casting.WIDTH
    instances = np.where(classes[seen] > 0, 1000 * classes[seen] + seen, 0)
    observed = casting.observe([], camera)
    observed["image_depth"] = np.where(hit >= 0, depth, np.inf).reshape(shape).astype(np.float32)
    observed["image_segment"] = {
        "class_segment_img": classes[seen].reshape(shape).astype(np.uint8),
        "instance_segment_img": instances.reshape(shape).astype(np.uint16),
        "class_ids": number_of,
    }
    return observed


@pytest.mark.parametrize("title", FORMATS)
def test_mapping_what_was_imported_scores(title: str, tmp_path: Path) -> None:
    """The examples drive through each environment as it was written, and OMQ scores them by its ground truth."""
    write(build(FORMATS[title](tmp_path), "room", CARTER, Guesses()), tmp_path / "made")
    scene = load_scene(tmp_path / "made" / "scenes" / "room_1.glb")
    truth = json.loads((tmp_path / "made" / "ground_truths" / "room_1.json").read_text())
    agents: dict[str, Agent] = {"mapper": SegmentationMapper(), "nothing": PassiveAgent()}
    for pose in truth["environment"]["trajectory_poses"]:
        observations = _observed(scene, pose)
        for agent in agents.values():
            assert agent.pick_action(observations, ["move_next"])[0] == "move_next"
    scores = {}
    for name, agent in agents.items():
        empty = {"task_details": {"results_format": "object_map"}, "results": object_map.create()}
        agent.save_result(str(tmp_path / f"{name}.json"), empty, {})
        result = json.loads((tmp_path / f"{name}.json").read_text())
        object_map.validate(result["results"])
        scores[name] = omq.evaluate(result, [truth])["OMQ"]
    assert scores["nothing"] == 0.0
    assert scores["mapper"] > 0.95


def test_masks_and_truth_are_kept_in_the_environment(tmp_path: Path) -> None:
    imported = build(scanned.scannetpp(tmp_path), "room", CARTER, Guesses())
    assert imported.unseen == ()
    assert len(imported.declaration["trajectory_poses"]) >= 10
    truth = imported.ground_truth
    schema.check(truth, "ground_truth", tmp_path / "truth.json")
    object_map_ground_truth.validate(truth["ground_truth"])
    turned = truth["ground_truth"]["objects"][0]["oriented_box"]
    w, x, y, z = turned["orientation"]
    assert (x, y) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert np.degrees(2 * np.arctan2(z, w)) % 90 == pytest.approx(30.0, abs=1e-3)


def test_omq_is_the_same_with_and_without_oriented_boxes(tmp_path: Path) -> None:
    understood = understand(scanned.scannetpp(tmp_path), Guesses())
    truth = _truth(understood)
    plain = [{key: value for key, value in entry.items() if key != "oriented_box"} for entry in truth]
    assert plain != truth
    estimates = [
        object_map.create_object(
            label_probs={entry["class"]: 0.8, "background": 0.2},
            centroid=[value + 0.03 for value in entry["centroid"]],
            extent=entry["extent"],
        )
        for entry in truth[:4]
    ]
    classes = list(object_map.CLASS_LIST)
    details = {"results_format": "object_map"}
    result: Any = {"task_details": details, "results": {"objects": estimates, "class_list": classes}}
    scores = [
        omq.evaluate(result, [cast(Any, {"ground_truth": {"objects": objects, "class_list": classes}})])
        for objects in (truth, plain)
    ]
    assert scores[0] == scores[1]
    assert 0.3 < scores[0]["OMQ"] < 1.0


@pytest.mark.parametrize(
    ("label", "class_name"),
    [
        ("office chair", "chair"),
        ("computer-keyboard", "keyboard"),
        ("indoor-plant", "potted plant"),
        ("tv-screen", "tv"),
        ("stack of books", "book"),
        ("oven glove", None),
        ("chair cushion", None),
        ("kitchen cabinet", None),
        ("wall", None),
        ("", None),
    ],
)
def test_a_label_means_its_last_noun(label: str, class_name: str | None) -> None:
    assert class_of(label) == class_name


def test_a_person_says_what_labels_or_single_objects_are(tmp_path: Path) -> None:
    known = Guesses(classes={"zorbing ball": "couch", "tv": None, "office chair 6": "table"})
    objects = {entry["ID_name"]: entry["class"] for entry in _truth(understand(scanned.scannet(tmp_path), known))}
    assert objects == {
        "dining table 5": "table",
        "office chair 6": "table",
        "couch 7": "couch",
        "refrigerator 8": "refrigerator",
        "zorbing ball 11": "couch",
    }


def test_labels_can_be_left_aside_or_named(tmp_path: Path) -> None:
    scan = scanned.boxes_json(tmp_path)
    assert understand(scan, Guesses(), "none").labelled is None
    other = tmp_path / "other.json"
    entry = {"label": "bed", "centroid": [0.5, 2.6, 0.4], "extent": [0.9, 1.9, 0.8], "group": True}
    other.write_text(json.dumps({"objects": [entry]}))
    (found,) = _truth(understand(scan, Guesses(), other))
    assert (found["class"], found["isgroup"]) == ("bed", True)


def test_a_semantic_mesh_that_is_turned_against_the_scan_is_turned_back(tmp_path: Path) -> None:
    scanned.hm3d(tmp_path)
    scan = scanned.write_ply(tmp_path / "a7Xq.ply", scanned.room())
    understood = understand(scan, Guesses())
    assert understood.up == "z"
    assert [entry["class"] for entry in _truth(understood)] == [box.class_name for box in TRUTH.values()]


def test_boxes_of_a_scan_far_from_its_origin_move_with_it(tmp_path: Path) -> None:
    scan = scanned.boxes_json(tmp_path)
    document = json.loads((tmp_path / "labels.json").read_text())
    for entry in document["objects"]:
        entry["centroid"] = np.add(entry["centroid"], [5000.0, -7000.0, 0.0]).tolist()
    (tmp_path / "labels.json").write_text(json.dumps(document))
    mesh = scanned.room()
    mesh.vertices[:] += [5000.0, -7000.0, 0.0]
    scanned.write_ply(scan, mesh)
    understood = understand(scan, Guesses())
    assert len(_truth(understood)) == len(TRUTH)


def test_what_has_no_surface_and_boxes_that_hold_nothing_are_named(tmp_path: Path) -> None:
    scan = scanned.scannetpp(tmp_path)
    path = tmp_path / "segments_anno.json"
    document = json.loads(path.read_text())
    document["segGroups"][5]["obb"]["centroid"] = [40.0, 0.0, 0.0]
    document["segGroups"].append({"objectId": 99, "label": "chair", "segments": [424242]})
    path.write_text(json.dumps(document))
    understood = understand(scan, Guesses())
    assert "oriented_box" not in _truth(understood)[0]
    assert any("dining table 5" in note and "do not hold" in note for note in understood.notes)
    assert any("chair 99" in note and "no surface" in note for note in understood.notes)


def test_a_scan_that_an_environment_names_has_its_labels(tmp_path: Path) -> None:
    scan = scanned.scannet(tmp_path)
    before = digest(scan)
    (tmp_path / "made.glb").write_bytes(convert(scan))
    classes = {found.class_name for found in load_scene(tmp_path / "made.glb").instances}
    assert classes == {None, *(box.class_name for box in TRUTH.values())}
    path = tmp_path / "scene0000_00.aggregation.json"
    path.write_text(path.read_text().replace('"tv"', '"bed"'))
    assert digest(scan) != before


def _spoil(folder: Path, name: str, text: str | bytes) -> None:
    (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)


def _anno(entry: dict[str, Any]) -> str:
    return json.dumps({"segGroups": [entry]})


def _entries(count: int, **changes: Any) -> str:
    entry = {"label": "tv", "name": "tv", "centroid": [0, 0, 0], "extent": [1, 1, 1], **changes}
    return json.dumps({"objects": [entry] * count})


@pytest.mark.parametrize(
    ("title", "name", "content", "said"),
    [
        ("ScanNet", "scene0000_00.aggregation.json", "{", "no JSON"),
        ("ScanNet", "scene0000_00.aggregation.json", "[" * 100_000, "no JSON"),
        ("ScanNet", "scene0000_00.aggregation.json", "[]", "no object with keys"),
        ("ScanNet", "scene0000_00.aggregation.json", '{"segGroups": []}', "names no object"),
        ("ScanNet", "scene0000_00.aggregation.json", '{"segGroups": [3]}', "no keys"),
        ("ScanNet", "scene0000_00.aggregation.json", _anno({"label": "tv"}), "segments"),
        ("ScanNet", "scene0000_00.aggregation.json", _anno({"label": 3, "segments": [1]}), "label"),
        ("ScanNet", "scene0000_00_vh_clean_2.0.010000.segs.json", '{"segIndices": [1, 2]}', "none of the meshes"),
        ("ScanNet", "scene0000_00_vh_clean_2.0.010000.segs.json", '{"segIndices": ["a"]}', "whole numbers"),
        ("ScanNet", "scene0000_00_vh_clean_2.0.010000.segs.json", '{"segIndices": [[1], 2]}', "segIndices"),
        ("ScanNet++", "segments_anno.json", _anno({"label": "tv", "segments": [1], "obb": {"centroid": 3}}), "obb"),
        ("Replica", "info_semantic.json", '{"objects": [{"id": 1, "class_name": "tv", "oriented_bbox": 3}]}', "bbox"),
        ("Replica", "mesh_semantic.ply", b"ply\nformat ascii 1.0\nend_header\n", "mesh_semantic.ply"),
        ("HM3D", "a7Xq.semantic.txt", "1,93E1D8,\"tv\",0\n", "first line"),
        ("HM3D", "a7Xq.semantic.txt", "HM3D Semantic Annotations\nx,y\n", "Line 2"),
        ("HM3D", "a7Xq.semantic.txt", "HM3D Semantic Annotations\n1,FFFFFE,\"tv\",0\n", "None of the colours"),
        ("Matterport3D", "17DR.house", "O 0 0\n", "Line 1"),
        ("labels.json", "labels.json", _entries(1, centroid=[0, 0]), "labels.json"),
        ("labels.json", "labels.json", _entries(1, extent=[1, 0, 1]), "extent"),
        ("labels.json", "labels.json", _entries(2), "two objects"),
        ("labels.csv", "lab.labels.csv", "label,x,y\ntv,1,2\n", "size_x"),
        ("labels.csv", "lab.labels.csv", "label,x,y,z,size_x,size_y,size_z\ntv,1,2,nan,1,1,1\n", "lab.labels.csv:2"),
        ("labels.csv", "lab.labels.csv", "label,x,y,z,size_x,size_y,size_z\ntv,1,2\n", "lab.labels.csv:2"),
    ],
)  # fmt: skip
def test_damaged_labels_are_refused_by_name(
    tmp_path: Path, title: str, name: str, content: str | bytes, said: str
) -> None:
    scan = FORMATS[title](tmp_path)
    _spoil(tmp_path, name, content)
    with pytest.raises(BenchbotError) as caught:
        understand(scan, Guesses())
    assert said in str(caught.value)
    assert caught.value.fix


def test_labels_without_the_files_that_they_need_and_of_another_place_are_refused(tmp_path: Path) -> None:
    scan = scanned.scannet(tmp_path)
    (tmp_path / "scene0000_00_vh_clean_2.0.010000.segs.json").unlink()
    with pytest.raises(BenchbotError, match="segments"):
        understand(scan, Guesses())
    scan = scanned.three_rscan(tmp_path)
    elsewhere = scanned.room()
    elsewhere.vertices[:] += 30.0
    for name, number in (("labels.instances.annotated.v2.ply", 0), ("scene0000_00_vh_clean_2.ply", 0)):
        scanned.write_ply(tmp_path / name, elsewhere, vertex={"objectId": elsewhere.vertex_object + number})
    with pytest.raises(BenchbotError, match="do not lie on the scan"):
        understand(scan, Guesses())
    with pytest.raises(BenchbotError, match="no file of labels"):
        understand(scan, Guesses(), tmp_path / "mesh.refined.v2.obj")


def test_objects_of_3rscan_are_found_without_segments(tmp_path: Path) -> None:
    scan = scanned.three_rscan(tmp_path)
    (tmp_path / "mesh.refined.0.010000.segs.v2.json").unlink()
    path = tmp_path / "semseg.v2.json"
    document = json.loads(path.read_text())
    for group in document["segGroups"]:
        group["objectId"] += 1
    path.write_text(json.dumps(document))
    assert [entry["class"] for entry in _truth(understand(scan, Guesses()))] == [
        box.class_name for box in ROOM if box.class_name
    ]
