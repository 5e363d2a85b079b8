"""Splats in GLB files: KHR_gaussian_splatting."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.plugin import BenchbotError
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import Y_UP_TO_Z_UP, load_scene
from benchbot_scenes.gltf_file import join_glb, split_glb
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.layout import read_layout
from benchbot_scenes.scene import Instance, Material, SceneGeometry
from benchbot_scenes.splats import Splats, covariances, transformed
from plugins.scenes.tests.test_splats import cloud

TRIANGLE = SceneGeometry(
    vertices=np.eye(3, dtype=np.float32),
    triangles=np.array([[0, 1, 2]], np.int32),
    triangle_instance=np.array([1], np.int32),
    triangle_material=np.array([0], np.int32),
    normals=np.full((3, 3), 3**-0.5, np.float32),
    uvs=np.zeros((3, 2), np.float32),
    materials=(Material(),),
    instances=(Instance(1, "corner", "table"),),
)


def assert_same(found: Splats | None, expected: Splats) -> None:
    assert found is not None
    for name in ("positions_m", "scales_m", "opacities", "colors", "color_slopes"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-5, atol=1e-5)
    # Quaternions have 16 bits.
    np.testing.assert_allclose(covariances(found), covariances(expected), atol=2e-4 * expected.scales_m.max() ** 2)


def changed(path: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """Write a scene with splats after a change to the document."""
    document, binary = split_glb(to_glb(replace(TRIANGLE, splats=cloud(0))))
    change(document)
    path.write_bytes(join_glb(document, binary))
    return path


def splat_primitive(document: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = document["meshes"][1]["primitives"][0]
    return found


def test_splats_come_back_beside_the_mesh(tmp_path: Path) -> None:
    splats = cloud(0)
    path = tmp_path / "room.glb"
    path.write_bytes(to_glb(replace(TRIANGLE, splats=splats)))
    scene = load_scene(path)
    assert_same(scene.splats, splats)
    assert [instance.name for instance in scene.instances] == ["corner"]
    assert scene.content_hash == replace(scene, splats=None).content_hash
    document, _ = split_glb(path.read_bytes())
    assert document["extensionsUsed"] == ["KHR_gaussian_splatting"]
    assert splat_primitive(document)["mode"] == 0
    assert to_glb(scene)[:4] == b"glTF"


def test_a_splat_takes_84_bytes_and_48_where_no_colour_changes_with_the_view() -> None:
    def size(splats: Splats) -> int:
        return len(split_glb(to_glb(replace(TRIANGLE, splats=splats)))[1])

    few, many = cloud(0, 10), cloud(0, 1010)
    assert size(many) - size(few) == 84 * 1000
    few, many = (replace(each, color_slopes=np.zeros_like(each.color_slopes)) for each in (few, many))
    assert size(many) - size(few) == 48 * 1000


def test_splats_follow_their_node(tmp_path: Path) -> None:
    def turn(document: dict[str, Any]) -> None:
        document["nodes"][1] |= {"rotation": [0.0, 0.0, 0.6, 0.8], "scale": [2.0, 2.0, 2.0], "translation": [1, 2, 3]}

    about_z = np.array([[0.28, -0.96, 0.0], [0.96, 0.28, 0.0], [0.0, 0.0, 1.0]])
    in_file = transformed(cloud(0), Y_UP_TO_Z_UP.T)
    expected = transformed(transformed(in_file, about_z, scale=2.0, offset=(1, 2, 3)), Y_UP_TO_Z_UP)
    assert_same(load_scene(changed(tmp_path / "turned.glb", turn)).splats, expected)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["nodes"][1].update(scale=[1.0, 2.0, 1.0]), "stretches or mirrors"),
        (lambda d: d["nodes"][1].update(scale=[-1.0, 1.0, 1.0]), "stretches or mirrors"),
        (lambda d: d["nodes"][1].update(scale=[0.0, 0.0, 0.0]), "stretches or mirrors"),
        (lambda d: splat_primitive(d)["extensions"]["KHR_gaussian_splatting"].update(kernel="box"), "kernel 'box'"),
        (
            lambda d: splat_primitive(d)["extensions"]["KHR_gaussian_splatting"].update(
                colorSpace="lin_rec709_display"
            ),
            "colorSpace 'lin_rec709_display'",
        ),
        (lambda d: splat_primitive(d).update(mode=4), "primitive of points"),
        (lambda d: splat_primitive(d)["attributes"].pop("KHR_gaussian_splatting:SCALE"), "KeyError"),
        (lambda d: splat_primitive(d)["attributes"].pop("KHR_gaussian_splatting:SH_DEGREE_1_COEF_2"), "KeyError"),
        (
            lambda d: splat_primitive(d)["attributes"].update(
                {"KHR_gaussian_splatting:OPACITY": splat_primitive(d)["attributes"]["POSITION"]}
            ),
            "no 1 finite numbers each as their OPACITY",
        ),
        (
            lambda d: splat_primitive(d)["attributes"].update(
                {"KHR_gaussian_splatting:SCALE": splat_primitive(d)["attributes"]["POSITION"]}
            ),
            "a scale or an opacity that is none",
        ),
        (lambda d: splat_primitive(d).update(extensions={"KHR_gaussian_splatting": []}), "AttributeError"),
    ],
)
def test_splats_that_cannot_be_drawn_are_refused(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], said: str
) -> None:
    with pytest.raises(BenchbotError) as refused:
        load_scene(changed(tmp_path / "broken.glb", change))
    assert said in f"{refused.value}"


def test_a_layout_on_a_finished_scene_keeps_its_splats(tmp_path: Path) -> None:
    (tmp_path / "room.glb").write_bytes(to_glb(replace(TRIANGLE, splats=cloud(0))))
    (tmp_path / "layout.yaml").write_text(json.dumps({"assets": "household", "base": "room.glb"}))
    (tmp_path / "other.glb").write_bytes(compose(read_layout(tmp_path / "layout.yaml")))
    assert_same(load_scene(tmp_path / "other.glb").splats, cloud(0))
