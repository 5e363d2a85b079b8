"""Environments made of files: what is written, that it can be used, and that a person's corrections count."""

import json
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import yaml

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot_scenes.coverage import MARGIN_M
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing import report
from benchbot_scenes.importing.environment import Imported, build, write
from benchbot_scenes.importing.guesses import Guesses, read_guesses
from benchbot_scenes.routes import least_clearance
from benchbot_scenes.visibility import CARTER
from plugins.scenes.tests.importing import places
from plugins.scenes.tests.importing.places import trimesh


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return places.write(tmp_path_factory.mktemp("source") / "flat.obj", places.flat(), 100.0)


@pytest.fixture(scope="module")
def imported(source: Path) -> Imported:
    return build(source, "flat", CARTER, Guesses())


def test_the_robot_starts_in_free_space_and_drives_without_contact(imported: Imported) -> None:
    space, start = imported.room.space, imported.declaration["start_pose"]
    places_on_the_way = [(pose[4], pose[5]) for pose in (start, *imported.declaration["trajectory_poses"])]
    assert space.clearance_at(*places_on_the_way[0]) >= CARTER.radius_m
    for here, there in pairwise(places_on_the_way):
        assert least_clearance(space, here, there) >= CARTER.radius_m
    assert all(
        math.hypot(*pose[:4]) == pytest.approx(1.0, abs=1e-5) for pose in imported.declaration["trajectory_poses"]
    )
    assert imported.unseen == ()


def test_the_ground_truth_is_where_the_objects_are(imported: Imported) -> None:
    objects = {entry["ID_name"]: entry for entry in imported.ground_truth["ground_truth"]["objects"]}
    assert {name: entry["class"] for name, entry in objects.items()} == places.CLASSES
    assert objects["TV"]["centroid"] == pytest.approx([0.14, 1.0, 0.8], abs=1e-4)
    assert objects["TV"]["extent"] == pytest.approx([0.08, 1.0, 0.6], abs=1e-4)
    assert [name for name, entry in objects.items() if entry["isgroup"]] == ["books"]


def test_what_is_written_is_an_environment(imported: Imported, tmp_path: Path) -> None:
    write(imported, tmp_path)
    path = tmp_path / "environments" / "flat_1.yaml"
    document = yaml.safe_load(path.read_text())
    schema.check(document, "environment", path)
    truth = tmp_path / "ground_truths" / "flat_1.json"
    schema.check(json.loads(truth.read_text()), "ground_truth", truth)
    scene = load_scene(path.parent / document["map_path"])
    assert {found.name for found in scene.instances if found.class_name} == set(places.CLASSES)
    assert yaml.safe_load((tmp_path / "maps" / "flat_1.yaml").read_text())["image"] == "flat_1.png"


def test_the_guesses_that_are_written_give_the_same_environment(
    imported: Imported, source: Path, tmp_path: Path
) -> None:
    write(imported, tmp_path)
    known = read_guesses(tmp_path / "guesses.yaml")
    again = build(source, "flat", CARTER, known)
    assert again.ground_truth == imported.ground_truth
    assert again.declaration["start_pose"] == pytest.approx(imported.declaration["start_pose"], abs=1e-4)
    assert again.guesses == known


def test_corrected_guesses_count(imported: Imported, source: Path) -> None:
    classes = {**imported.guesses.classes, "tv stand": "table", "CoffeeMug": None}
    known = replace(imported.guesses, classes=classes, hidden=("Ceiling",), start_pose=(3.0, 1.0, 90.0))
    again = build(source, "flat", CARTER, known)
    objects = {entry["ID_name"]: entry["class"] for entry in again.ground_truth["ground_truth"]["objects"]}
    assert objects["tv stand"] == "table"
    assert "CoffeeMug" not in objects
    assert "UCX_Table_01" in {found.name for found in again.geometry.instances}
    assert again.declaration["start_pose"] == pytest.approx([math.sqrt(0.5), 0, 0, math.sqrt(0.5), 3.0, 1.0, 0.0])
    assert any("open from above" in note for note in again.notes)


def test_a_start_in_the_furniture_is_refused(imported: Imported, source: Path) -> None:
    with pytest.raises(BenchbotError) as caught:
        build(source, "flat", CARTER, replace(imported.guesses, start_pose=(4.2, 3.0, 0.0)))
    assert "does not fit at the start" in caught.value.title


def test_a_place_without_room_is_refused(source: Path) -> None:
    with pytest.raises(BenchbotError) as caught:
        build(source, "flat", replace(CARTER, radius_m=3.0), Guesses())
    assert "--units" in caught.value.fix


def test_a_closed_room_gets_lamps_and_one_with_a_window_none(tmp_path: Path, imported: Imported) -> None:
    path = places.write(tmp_path / "cell.glb", places.flat(window=False))
    closed = build(path, "cell", CARTER, Guesses())
    lamps = [found for found in closed.geometry.instances if found.name.startswith("ceiling lamp")]
    assert lamps
    assert closed.declaration["lighting"]["sun"]["irradiance"] == [0.0, 0.0, 0.0]
    corners = closed.geometry.vertices[closed.geometry.triangles[closed.geometry.triangle_instance == lamps[0].index]]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] < 0).all()
    assert corners[..., 2].max() == pytest.approx(places.SIZE_M[2] - 0.05, abs=1e-4)
    assert not any(found.name.startswith("ceiling lamp") for found in imported.geometry.instances)
    assert "lighting" not in imported.declaration


def test_a_scan_in_one_piece_gets_a_trajectory_too(tmp_path: Path) -> None:
    path = places.write(tmp_path / "scan.ply", places.flat(ceiling=False), up="z")
    scan = build(path, "scan", CARTER, Guesses())
    assert scan.ground_truth["ground_truth"]["objects"] == []
    assert len(scan.declaration["trajectory_poses"]) > 10
    assert any("open from above" in note for note in scan.notes)


def test_the_report_needs_nothing_but_itself(imported: Imported) -> None:
    page = report.page(imported, "flat.obj", [])
    assert page.count("data:image/jpeg;base64,") == 2
    assert "http" not in page
    assert "<script" not in page
    assert "CoffeeMug" in page
    assert "UCX_Table_01" in page


def test_the_map_in_the_report_shows_start_and_way(imported: Imported) -> None:
    picture = np.asarray(report.map_picture(imported))
    assert (picture == (200, 60, 30)).all(axis=-1).any()
    assert (picture == (29, 90, 143)).all(axis=-1).any()


def test_names_in_a_report_are_no_markup(tmp_path: Path) -> None:
    boxes = [
        *places.flat(),
        replace(places.flat()[6], name="<script>chair</script>", low=(2.4, 0.1, 0), high=(2.8, 0.5, 0.9)),
    ]
    scene = trimesh.Scene()
    for box in boxes:
        scene.add_geometry(
            box.mesh.apply_transform(trimesh.transformations.rotation_matrix(-math.pi / 2, (1, 0, 0))),
            node_name=box.name,
            geom_name=box.name,
        )
    scene.export(tmp_path / "flat.glb")
    page = report.page(build(tmp_path / "flat.glb", "flat", CARTER, Guesses()), "flat.glb", [])
    assert "<script>" not in page
    assert "&lt;script&gt;chair" in page


def test_margin_is_kept_at_the_start(imported: Imported) -> None:
    x, y, _ = imported.room.start
    assert imported.room.space.clearance_at(x, y) >= CARTER.radius_m + MARGIN_M
