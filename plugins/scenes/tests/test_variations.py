"""Variations of models: always the same, of the box that they say, in the finishes that they say."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.catalogue import LOOKS, AssetModel, Catalogue, Surface, load_catalogue
from benchbot_scenes.compose import compose, recipe
from benchbot_scenes.glb_writer import GlbWriter
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.intersections import triangles_of
from benchbot_scenes.layout import Layout, Placement, read_layout, write_layout
from benchbot_scenes.placing import place
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.scene_file import scene_file
from benchbot_scenes.variations import OWN, Varying, read_palettes
from plugins.scenes.tests import packs
from plugins.scenes.tests.plans import two_rooms

PALETTES: dict[str, list[dict[str, Any]]] = {
    "cloth": [
        {"textures": [OWN], "colors": ["#ffffff", "#bcbcbc"]},
        {"textures": ["weave"], "colors": ["#ff0000"], "windows": [[1.0, 0.0, 0.5, 1.0]], "roughness": 0.9},
        {"colors": ["#0000ff"], "roughness": 0.4, "metallic": 1.0},
    ]
}
SCALE = (("xy", 0.9, 1.1), ("z", 0.8, 1.2))


@pytest.fixture
def blocks(tmp_path: Path) -> Catalogue:
    """The tests' pack with a chair and a table that vary, and looks."""
    made = packs.pack(tmp_path / "pack")
    writer = GlbWriter()
    writer.material(packs.textured(writer, (1.0, 1.0, 1.0), "weave"))
    looks = tmp_path / "pack" / LOOKS
    looks.write_bytes(writer.to_bytes())
    varies = Varying(SCALE, (read_palettes(PALETTES)["cloth"],))
    top = Surface(0.7, (-0.3, -0.7), (0.3, 0.7), 1.2)
    changed = {
        "chair": replace(made.models["chair"], varies=varies, looks=looks),
        "table": replace(made.models["table"], varies=varies, looks=looks, surfaces=(top,)),
    }
    return Catalogue(made.name, {**made.models, **changed}, made.finishes)


def scene(blocks: Catalogue, tmp_path: Path, *objects: Placement) -> SceneGeometry:
    path = tmp_path / "scene.glb"
    path.write_bytes(compose(Layout(blocks.name, None, objects), {blocks.name: blocks}))
    return load_scene(path)


def numbered(blocks: Catalogue, texture: str | None, color: tuple[float, ...] | None = None) -> AssetModel:
    """The first chair in a finish of this texture (and colour, before wear)."""
    for number in range(1, 999):
        chair = blocks.model(f"chair~{number}")
        (finish,) = chair.finish
        if finish is not None and finish.texture == texture and color in (None, finish.color):
            return chair
    raise AssertionError


def test_a_variation_is_always_the_same(blocks: Catalogue) -> None:
    assert blocks.model("chair~7") == blocks.model("chair~7")
    assert (blocks.model("chair~7").base_id, blocks.model("chair~7").number) == ("chair", 7)
    assert (blocks.model("chair").base_id, blocks.model("chair").number) == ("chair", 0)
    assert blocks.model("chair").variation(0) == blocks.model("chair")


def test_what_scales_together_does_and_all_within_limits(blocks: Catalogue) -> None:
    scales = [blocks.model(f"table~{number}").scale for number in range(1, 200)]
    assert all(x == y and 0.9 <= x <= 1.1 and 0.8 <= z <= 1.2 for x, y, z in scales)
    assert len(set(scales)) > 150


def test_the_size_and_the_surfaces_are_scaled(blocks: Catalogue) -> None:
    table = blocks.model("table~3")
    (x, y, z), (surface,) = table.scale, table.surfaces
    assert table.size_m == pytest.approx((0.8 * x, 1.6 * y, 0.7 * z), abs=1e-4)
    assert (surface.z_m, *surface.high_m) == pytest.approx((0.7 * z, 0.3 * x, 0.7 * y), abs=1e-4)
    assert surface.headroom_m == pytest.approx(1.2 * z, abs=1e-4)


def test_successive_numbers_take_successive_finishes(blocks: Catalogue) -> None:
    textures = [
        found and (found.texture, found.metallic) for n in range(1, 9) for found in blocks.model(f"chair~{n}").finish
    ]
    assert textures[:4] == textures[4:]
    assert len(set(textures)) == 3


@pytest.mark.parametrize("number", ["0", "1000", "-1", "07", "x", "", "7~8", "٣"])
def test_a_number_that_is_none_is_told(blocks: Catalogue, number: str) -> None:
    with pytest.raises(BenchbotError, match="has no variation") as caught:
        blocks.model(f"chair~{number}")
    assert "1 to 999" in caught.value.why


def test_a_model_that_does_not_vary_has_no_variations(blocks: Catalogue) -> None:
    with pytest.raises(BenchbotError, match="'picture' of the asset pack 'blocks' has no variation '7'") as caught:
        blocks.model("picture~7")
    assert caught.value.fix == "Name it 'picture'."
    with pytest.raises(BenchbotError, match="no model 'chain~7'") as caught:
        blocks.model("chain~7")
    assert "chair" in caught.value.why


def test_the_composed_box_is_that_of_the_catalogue(blocks: Catalogue, tmp_path: Path) -> None:
    made = scene(blocks, tmp_path, Placement("chair_1", "chair~5", (1.0, 2.0, 0.0), 90.0))
    low, high = made.vertices.min(axis=0), made.vertices.max(axis=0)
    x, y, z = blocks.model("chair~5").size_m
    np.testing.assert_allclose(high - low, (y, x, z), atol=1e-3)
    np.testing.assert_allclose((low + high)[:2] / 2, (1.0, 2.0), atol=1e-3)


def test_a_size_of_the_layout_is_kept(blocks: Catalogue, tmp_path: Path) -> None:
    made = scene(blocks, tmp_path, Placement("chair_1", "chair~5", (0.0, 0.0, 0.0), size_m=(0.6, 0.5, 1.0)))
    np.testing.assert_allclose(np.ptp(made.vertices, axis=0), (0.6, 0.5, 1.0), atol=1e-3)


def test_triangles_are_where_the_scene_has_them(blocks: Catalogue, tmp_path: Path) -> None:
    placement = Placement("chair_1", "chair~9", (1.0, 2.0, 0.0), 30.0)
    made = scene(blocks, tmp_path, placement)
    expected = made.vertices[made.triangles]
    np.testing.assert_allclose(triangles_of(placement, blocks.model("chair~9")), expected, atol=1e-5)
    without_file = replace(blocks.model("chair~9"), file=tmp_path / "none.glb")
    box = triangles_of(replace(placement, yaw_deg=0.0), without_file)
    np.testing.assert_allclose(np.ptp(box.reshape(-1, 3), axis=0), without_file.size_m, atol=1e-9)


def test_a_finish_tints_replaces_or_removes_the_texture(blocks: Catalogue, tmp_path: Path) -> None:
    chairs = [numbered(blocks, texture) for texture in (OWN, "weave", None)]
    placed = [Placement(f"chair_{n}", chair.id, (2.0 * n, 0.0, 0.0)) for n, chair in enumerate(chairs)]
    made = scene(blocks, tmp_path, *placed)
    own, woven, plain = made.materials[:3]
    (tint,) = chairs[0].finish
    assert tint is not None
    assert own.base_color_image is not None
    assert own.base_color == pytest.approx([0.5 * channel for channel in tint.color], abs=1e-5)
    assert woven.base_color_image is not None
    assert woven.roughness >= 0.9
    assert woven.base_color[1:] == (0.0, 0.0)
    assert (plain.base_color_image, plain.metallic) == (None, 1.0)
    assert plain.base_color[:2] == (0.0, 0.0)


def test_a_window_shows_a_part_of_the_texture_mirrored(blocks: Catalogue, tmp_path: Path) -> None:
    plain = scene(blocks, tmp_path, Placement("chair_1", "chair", (0.0, 0.0, 0.0)))
    woven = scene(blocks, tmp_path, Placement("chair_1", numbered(blocks, "weave").id, (0.0, 0.0, 0.0)))
    np.testing.assert_allclose(woven.uvs[:, 0], 1.0 - 0.5 * plain.uvs[:, 0], atol=1e-6)
    np.testing.assert_allclose(woven.uvs[:, 1], plain.uvs[:, 1], atol=1e-6)


def test_a_file_is_in_the_scene_once_whatever_it_is_finished_with(blocks: Catalogue) -> None:
    def composed(count: int) -> bytes:
        objects = tuple(Placement(f"chair_{n}", f"chair~{n}", (2.0 * n, 0.0, 0.0)) for n in range(1, count + 1))
        return compose(Layout(blocks.name, None, objects), {blocks.name: blocks})

    # Another chair is a node, a mesh and perhaps a material: no vertices, no picture.
    assert len(composed(40)) - len(composed(20)) < 20 * 700


def test_the_same_layout_gives_the_same_bytes(blocks: Catalogue, tmp_path: Path) -> None:
    layout = Layout(blocks.name, two_rooms(), (Placement("chair_1", "chair~5", (1.0, 1.0, 0.0)),))
    write_layout(tmp_path / "layout.yaml", layout)
    again = read_layout(tmp_path / "layout.yaml")
    assert again == layout
    assert compose(layout, {"blocks": blocks}) == compose(again, {"blocks": blocks})


def test_a_stand_in_fills_the_box_of_the_variation(blocks: Catalogue, tmp_path: Path) -> None:
    other = packs.pack(tmp_path / "other", "other")
    chair = blocks.model("chair~5")
    placed = place(Placement("chair_1", "chair~5", (0.0, 0.0, 0.0)), chair, other)
    assert placed.model.id == "chair"
    corners = np.array(placed.model.size_m) * np.diag(placed.matrix)[:3]
    np.testing.assert_allclose(corners, chair.size_m, atol=1e-9)


def test_other_looks_make_another_scene_file(
    blocks: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchbot_scenes.catalogue.pack", lambda _: blocks)
    made = set()
    for number in (1, 2):
        chair = Placement("chair_1", f"chair~{number}", (1.0, 1.0, 0.0), size_m=(0.5, 0.5, 0.5))
        write_layout(tmp_path / "room.yaml", Layout("blocks", two_rooms(), (chair,)))
        made.add(scene_file(tmp_path / "room.yaml", tmp_path / "cache"))
        assert blocks.models["chair"].looks in recipe(read_layout(tmp_path / "room.yaml")).files()
    assert len(made) == 2


def test_looks_that_are_not_there_are_told(blocks: Catalogue, tmp_path: Path) -> None:
    chair = numbered(blocks, "weave")
    (tmp_path / "pack" / LOOKS).unlink()
    with pytest.raises(BenchbotError, match="looks of an asset pack cannot be read"):
        scene(blocks, tmp_path, Placement("chair_1", chair.id, (0.0, 0.0, 0.0)))


@pytest.mark.parametrize(
    "varies", [{"finishes": ["silk"]}, {"scale": {"w": [0.9, 1.1]}}, {"scale": {"x": [1.1, 0.9]}}, {"scale": {"x": 1}}]
)
def test_a_catalogue_that_varies_wrongly_is_refused(varies: dict[str, object], tmp_path: Path) -> None:
    entry: dict[str, Any] = {
        "id": "a",
        "file": "a.glb",
        "class": None,
        "kind": "a",
        "placement": "floor",
        "size_m": [1, 1, 1],
    }
    entry |= {"triangles": 1, "licence": "", "author": "", "source": "", "varies": varies}
    path = tmp_path / "catalogue.json"
    path.write_text(json.dumps({"name": "mine", "palettes": PALETTES, "models": [entry]}))
    with pytest.raises(BenchbotError, match="catalogue of an asset pack cannot be read"):
        load_catalogue(path)
