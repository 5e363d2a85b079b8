"""Layouts as scenes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.catalogue import Catalogue
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.gltf_file import split_glb
from benchbot_scenes.ground_truth import object_boxes
from benchbot_scenes.layout import Building, Layout, Placement
from benchbot_scenes.scene import SceneGeometry
from plugins.scenes.tests import packs
from plugins.scenes.tests.plans import DOOR, WEST, WINDOW, two_rooms

PLAIN = Building(2.5, 0.3, (WEST,), ())
CHAIR = Placement("chair 1", "chair", (1.0, 2.0, 0.0))


@pytest.fixture
def blocks(tmp_path: Path) -> Catalogue:
    return packs.pack(tmp_path / "blocks")


def composed(folder: Path, layout: Layout, *catalogues: Catalogue, assets: str | None = None) -> SceneGeometry:
    path = folder / "scene.glb"
    path.write_bytes(compose(layout, {catalogue.name: catalogue for catalogue in catalogues}, assets))
    return load_scene(path)


def box(scene: SceneGeometry, name: str) -> tuple[list[float], list[float]]:
    low, high = object_boxes(scene)[name]
    return [round(float(value), 4) for value in low], [round(float(value), 4) for value in high]


def nose(scene: SceneGeometry, name: str) -> np.ndarray:
    """Where an object's nose points: from its box's middle, at the floor, to where the fewest vertices are."""
    index = next(instance.index for instance in scene.instances if instance.name == name)
    corners = scene.vertices[scene.triangles[scene.triangle_instance == index]].reshape(-1, 3)
    low, high = object_boxes(scene)[name]
    body = corners[corners[:, 2] > (low[2] + high[2]) / 2]
    offset = (low + high)[:2] / 2 - (body.min(axis=0) + body.max(axis=0))[:2] / 2
    return np.asarray(np.round(offset, 4) * 2 / packs.NOSE_M)


def test_an_object_stands_where_its_layout_says(tmp_path: Path, blocks: Catalogue) -> None:
    scene = composed(tmp_path, Layout("blocks", PLAIN, (CHAIR,)), blocks)
    assert box(scene, "chair 1") == ([0.75, 1.8, 0.0], [1.25, 2.2, 0.9])
    (chair,) = (instance for instance in scene.instances if instance.name == "chair 1")
    assert (chair.class_name, chair.is_group) == ("chair", False)


@pytest.mark.parametrize(
    ("yaw_deg", "front"), [(0, (1, 0)), (90, (0, 1)), (180, (-1, 0)), (-90, (0, -1)), (450, (0, 1))]
)
def test_models_face_x_and_turn_counter_clockwise(
    tmp_path: Path, blocks: Catalogue, yaw_deg: float, front: tuple[int, int]
) -> None:
    scene = composed(tmp_path, Layout("blocks", PLAIN, (replace(CHAIR, yaw_deg=yaw_deg),)), blocks)
    assert nose(scene, "chair 1") == pytest.approx(front, abs=0.02)


def test_a_size_is_given_along_the_models_own_axes(tmp_path: Path, blocks: Catalogue) -> None:
    large = replace(CHAIR, yaw_deg=90, size_m=(1.0, 0.6, 1.2))
    scene = composed(tmp_path, Layout("blocks", PLAIN, (large,)), blocks)
    assert box(scene, "chair 1") == ([0.7, 1.5, 0.0], [1.3, 2.5, 1.2])


def test_class_and_group_may_differ_from_the_models(tmp_path: Path, blocks: Catalogue) -> None:
    objects = (
        replace(CHAIR, id="a", class_name="couch", is_group=True),
        replace(CHAIR, id="b", class_name="", position=(2.0, 2.0, 0.0)),
    )
    scene = composed(tmp_path, Layout("blocks", PLAIN, objects), blocks)
    tags = {instance.name: (instance.class_name, instance.is_group) for instance in scene.instances}
    assert tags["a"] == ("couch", True)
    assert tags["b"] == (None, False)


def test_what_is_used_twice_is_in_the_file_once(blocks: Catalogue) -> None:
    catalogues = {"blocks": blocks}
    once = split_glb(compose(Layout("blocks", PLAIN, (CHAIR,)), catalogues))[0]
    chairs = tuple(replace(CHAIR, id=f"chair {i}", position=(0.5 + i / 2, 1.0, 0.0)) for i in range(5))
    table = Placement("table 1", "table", (2.0, 2.0, 0.0))
    many = split_glb(compose(Layout("blocks", PLAIN, (*chairs, table)), catalogues))[0]
    assert len(many["meshes"]) == len(once["meshes"]) + 1
    assert len(many["images"]) == 1
    assert len(many["nodes"]) == len(once["nodes"]) + 5


def test_the_same_layout_gives_the_same_bytes(blocks: Catalogue) -> None:
    layout = Layout("blocks", two_rooms(DOOR, WINDOW), (CHAIR,))
    assert compose(layout, {"blocks": blocks}) == compose(layout, {"blocks": blocks})


def test_rooms_have_their_finishes_at_real_scale(tmp_path: Path, blocks: Catalogue) -> None:
    boarded = replace(WEST, floor="boards", walls="#804020")
    scene = composed(tmp_path, Layout("blocks", Building(2.5, 0.3, (boarded,), ())), blocks)
    triangles = {
        instance.name: scene.triangles[scene.triangle_instance == instance.index] for instance in scene.instances
    }
    materials = {
        name: scene.materials[scene.triangle_material[np.flatnonzero((scene.triangles == rows[0]).all(axis=1))[0]]]
        for name, rows in triangles.items()
    }
    assert materials["floor west"].name == "boards"
    assert np.ptp(scene.uvs[triangles["floor west"].ravel()], axis=0) == pytest.approx([4 / 2.0, 3 / 0.5])
    assert materials["walls west"].base_color == pytest.approx((0.2159, 0.0513, 0.0144), abs=1e-3)


def test_a_missing_finish_is_named(blocks: Catalogue) -> None:
    layout = Layout("blocks", Building(2.5, 0.3, (replace(WEST, floor="bords"),), ()))
    with pytest.raises(BenchbotError, match="no finish 'bords'") as caught:
        compose(layout, {"blocks": blocks})
    assert "Did you mean 'boards'?" in caught.value.why


def test_a_missing_model_is_named(blocks: Catalogue) -> None:
    with pytest.raises(BenchbotError, match="no model 'chiar'") as caught:
        compose(Layout("blocks", PLAIN, (replace(CHAIR, model="chiar"),)), {"blocks": blocks})
    assert "'chair'" in caught.value.why


@pytest.mark.parametrize("damage", [lambda data: data[:100], lambda data: b"", lambda data: data[:-40]])
def test_a_damaged_model_is_named(blocks: Catalogue, damage: object) -> None:
    path = blocks.model("chair").file
    path.write_bytes(damage(path.read_bytes()))  # type: ignore[operator]
    with pytest.raises(BenchbotError, match=r"chair\.glb cannot be used in a layout"):
        compose(Layout("blocks", PLAIN, (CHAIR,)), {"blocks": blocks})
    path.unlink()
    with pytest.raises(BenchbotError, match="no scene file"):
        compose(Layout("blocks", PLAIN, (CHAIR,)), {"blocks": blocks})
