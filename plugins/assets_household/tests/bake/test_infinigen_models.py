"""From baked parts to models and their entries; baking itself needs infinigen and is not tested here."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.gltf import load_scene
from plugins.assets_household.bake.infinigen_models import MODELS, entry, placed, read_table
from plugins.assets_household.bake.parts import Part, Surface, load_parts, save_parts
from plugins.assets_household.bake.write_glb import write_glb

TABLE = Path(__file__).parents[2] / "bake" / "infinigen.toml"


def _part(surface: Surface | None = None) -> Part:
    """A wedge of 4 × 2 × 1 whose slope faces -x, away from the origin."""
    low, ridge = [[10.0, 5.0, 3.0], [10.0, 7.0, 3.0]], [[14.0, 5.0, 4.0], [14.0, 7.0, 4.0]]
    foot = [[14.0, 5.0, 3.0], [14.0, 7.0, 3.0]]
    slope, back = [low[0], ridge[0], ridge[1]], [foot[0], foot[1], ridge[1]]
    normals = [[-0.2425, 0.0, 0.9701]] * 3 + [[1.0, 0.0, 0.0]] * 3
    uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.25]] * 2
    return Part(np.array(slope + back), np.array(normals), np.array(uvs), surface or Surface("plain"))


def _picture() -> np.ndarray:
    picture = np.zeros((8, 8, 3), np.uint8)
    picture[:4], picture[4:] = (250, 10, 10), (10, 10, 250)
    return picture


@settings(max_examples=25, deadline=None)
@given(turn_deg=st.sampled_from([0.0, 90.0, 180.0, 270.0]), size=st.lists(st.floats(0.1, 3), min_size=3, max_size=3))
def test_placed_model_has_its_size_and_stands_on_the_origin(turn_deg: float, size: list[float]) -> None:
    (part,) = placed([_part()], turn_deg, size)
    np.testing.assert_allclose(part.positions.min(axis=0), [-size[0] / 2, -size[1] / 2, 0], atol=1e-9)
    np.testing.assert_allclose(part.positions.max(axis=0), [size[0] / 2, size[1] / 2, size[2]], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(part.normals, axis=1), 1.0)


def test_one_given_side_scales_all() -> None:
    (part,) = placed([_part()], 90.0, [0, 0, 0.5])
    np.testing.assert_allclose(np.ptp(part.positions, axis=0), [1.0, 2.0, 0.5])


def test_no_given_side_keeps_the_size() -> None:
    (part,) = placed([_part()], 0.0, [0, 0, 0])
    np.testing.assert_allclose(np.ptp(part.positions, axis=0), [4.0, 2.0, 1.0])


def test_front_turns_to_plus_x() -> None:
    (part,) = placed([_part()], 180.0, [0, 0, 0])
    np.testing.assert_allclose(part.normals[3], [-1, 0, 0], atol=1e-9)
    assert part.normals[0, 0] > 0


def test_parts_survive_the_archive(tmp_path: Path) -> None:
    surface = Surface("baked", (0.1, 0.2, 0.3), 0.4, 0.5, 1.0, (1.0, 2.0, 3.0), {"base_color": _picture()})
    save_parts(tmp_path / "model.npz", [_part(), _part(surface)])
    plain, baked = load_parts(tmp_path / "model.npz")
    assert (plain.surface.name, plain.surface.images) == ("plain", {})
    np.testing.assert_array_equal(baked.surface.images["base_color"], _picture())
    assert baked.surface.emission == (1.0, 2.0, 3.0)
    np.testing.assert_allclose(baked.positions, _part().positions)


def test_glb_shows_the_parts(tmp_path: Path) -> None:
    glass = Surface("glass", roughness=0.05, metallic=0.0, transmission=1.0)
    lamp = Surface("shade", emission=(0.9, 0.6, 0.3))
    baked = Surface("baked", images={"base_color": _picture()})
    path = tmp_path / "model.glb"
    path.write_bytes(write_glb("wedge", [_part(baked), _part(glass), _part(lamp)]))
    scene = load_scene(path)
    np.testing.assert_allclose(scene.vertices[:6], _part().positions, atol=1e-6)
    np.testing.assert_allclose(scene.normals[3], [1, 0, 0], atol=1e-6)
    assert [material.is_glass for material in scene.materials[:3]] == [False, True, False]
    np.testing.assert_allclose(scene.materials[2].emission, (0.9, 0.6, 0.3))
    row, column = int(scene.uvs[0, 1] * 8 - 0.5), int(scene.uvs[0, 0] * 8)
    assert tuple(scene.images[0][row, column, :3]) == (10, 10, 250), "v = 0 of the bake is the picture's lowest row"


def test_entry_says_what_the_model_is() -> None:
    row = {"id": "wedge_1", "class": "", "kind": "wedge", "placement": "floor", "stand_on": False, "group": False}
    found = entry(row | {"seed": 7, "factory": "shapes.WedgeFactory"}, placed([_part()], 0.0, [0, 0, 0]))
    assert (found["class"], found["size_m"], found["triangles"]) == (None, [4.0, 2.0, 1.0], 2)
    assert found["licence"] == "BSD-3-Clause"
    assert found["author"].endswith("seed 7")


def test_table_is_complete() -> None:
    rows = read_table(TABLE)
    assert len({row["id"] for row in rows}) == len(rows)
    assert {row["placement"] for row in rows} <= {"floor", "surface", "wall", "ceiling", "opening"}


@pytest.mark.parametrize("row", read_table(TABLE), ids=lambda row: str(row["id"]))
def test_every_row_has_its_model_and_entry(row: dict[str, object]) -> None:
    entries = {found["id"]: found for found in json.loads((MODELS / "infinigen.json").read_text(encoding="utf-8"))}
    scene = load_scene(MODELS / f"{row['id']}.glb")
    found = entries[row["id"]]
    np.testing.assert_allclose(np.ptp(scene.vertices, axis=0), found["size_m"], atol=0.002)
    np.testing.assert_allclose(scene.vertices.min(axis=0)[2], 0, atol=0.001)
    assert found["triangles"] == len(scene.triangles) <= 15_000
