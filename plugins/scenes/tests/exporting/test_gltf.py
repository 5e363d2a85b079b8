"""Exported glTF, imported again."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchbot_scenes.compose import compose
from benchbot_scenes.exporting import gltf
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing.guesses import beside
from benchbot_scenes.importing.understanding import understand
from benchbot_scenes.layout import Layout, Placement
from benchbot_scenes.scene import Instance, SceneGeometry
from plugins.scenes.tests.exporting import opened, rooms


def _again(geometry: SceneGeometry, folder: Path) -> SceneGeometry:
    path = opened.written(gltf.files(geometry, "room_1"), folder) / "room_1.glb"
    return understand(path, beside(path)).geometry


def test_what_is_imported_again_has_the_same_boxes_classes_and_masks(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    again = _again(geometry, tmp_path)
    assert rooms.apart_m(rooms.boxes(geometry), rooms.boxes(again)) <= 0.001
    assert rooms.marked(again) == rooms.marked(geometry)


def test_names_and_heights_that_an_import_would_guess_from_mean_nothing_here(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    names = {1: Instance(1, "UCX_Chair", None), 2: Instance(2, "table", None)}
    misleading = replace(
        geometry,
        vertices=geometry.vertices + np.array([0, 0, 0.35], np.float32),
        instances=tuple(names.get(found.index, found) for found in geometry.instances),
    )
    again = _again(misleading, tmp_path)
    assert rooms.apart_m(rooms.boxes(misleading), rooms.boxes(again)) <= 0.001
    assert rooms.marked(again) == rooms.marked(misleading)


def test_variations_keep_their_boxes_and_colours(tmp_path: Path) -> None:
    models = ("chair_padded~7", "picture_landscape~9", "bed_queen~3", "dining_chair_1~4")
    placed = tuple(Placement(f"{n}", model, (3.0 * n, 0.0, 0.0)) for n, model in enumerate(models))
    path = tmp_path / "varied.glb"
    path.write_bytes(compose(Layout("household", None, placed)))
    geometry = load_scene(path)
    again = _again(geometry, tmp_path)
    assert rooms.apart_m(rooms.boxes(geometry), rooms.boxes(again)) <= 0.001
    colors = {found.name: found.base_color for found in geometry.materials if found.name != "default"}
    assert {found.name: found.base_color for found in again.materials if found.name in colors} == colors
