"""Exported glTF, imported again."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchbot_scenes.exporting import gltf
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing.guesses import beside
from benchbot_scenes.importing.understanding import understand
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
