"""Exported SDFormat, checked by its schema and opened by Drake, whose parser is that of Gazebo."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.exporting import sdf
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import Instance, Material, SceneGeometry
from plugins.scenes.tests.exporting import opened, rooms, sdf_schema


def _written(geometry: SceneGeometry, folder: Path) -> Path:
    return opened.written(sdf.files(geometry, "room_1"), folder) / "room_1.sdf"


def _schema_errors(path: Path) -> list[str]:
    work = path.parent / "schema"
    work.mkdir()
    return sdf_schema.errors(path, work)


def test_drake_sees_the_same_boxes_and_gazebo_is_told_the_same_classes(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    path = _written(geometry, tmp_path)
    assert _schema_errors(path) == []
    assert rooms.apart_m(rooms.boxes(geometry), opened.drake_boxes(path)) <= 0.001
    classes = {found.name: found.class_name for found in geometry.instances if found.class_name is not None}
    assert opened.sdf_classes(path) == classes


def test_the_schema_is_one_that_finds_mistakes(tmp_path: Path) -> None:
    path = _written(load_scene(rooms.labelled(tmp_path)), tmp_path)
    path.write_text(path.read_text().replace("<static>true</static>", "<static>often</static>", 1))
    (told,) = {line.split("Element ")[1].split(":")[0] for line in _schema_errors(path)}
    assert told == "'static'"


def test_names_that_sdformat_keeps_for_itself_glass_textures_and_lamps_are_taken(tmp_path: Path) -> None:
    geometry = load_scene(rooms.labelled(tmp_path))
    materials = (
        Material("<cloth>", base_color_image=0),
        Material("pane", transmission=1.0),
        Material("lamp", emission=(5.0, 5.0, 4.0)),
    )
    odd_names = ("world", "a::b", "__reserved__", 'a <b>&"/', "", "a::b")
    instances = tuple(
        Instance(found.index, odd_names[number % len(odd_names)], "chair & table")
        for number, found in enumerate(geometry.instances)
    )
    odd = replace(
        geometry,
        materials=materials,
        triangle_material=(geometry.triangle_instance % 3).astype(np.int32),
        instances=instances,
        images=(np.full((4, 4, 4), 200, np.uint8),),
    )
    path = _written(odd, tmp_path)
    assert _schema_errors(path) == []
    assert len(opened.drake_boxes(path)) == len(instances)
    text = path.read_text()
    assert text.count('type="point"') == len({index for index in geometry.triangle_instance.tolist() if index % 3 == 2})
    assert text.count("<transparency>") == len(
        {index for index in geometry.triangle_instance.tolist() if index % 3 == 1}
    )
    assert (tmp_path / "room_1" / "0.png").is_file()


@pytest.mark.parametrize("name", ["chair_1", "Schrank 2", "büro-stuhl.3"])
def test_ordinary_names_stay(name: str) -> None:
    assert sdf._allowed(name) == name
