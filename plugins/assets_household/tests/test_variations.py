"""The variations of the pack's models: within what is real, in looks that are there."""

from pathlib import Path

import numpy as np
import pytest

import benchbot_assets_household
from benchbot_scenes.catalogue import LOOKS, AssetModel, Catalogue, load_catalogue
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import geometry_of
from benchbot_scenes.gltf_file import GltfFile, split_glb
from benchbot_scenes.layout import Layout, Placement
from benchbot_scenes.variations import OWN, VARIATIONS
from benchbot_scenes.violations import size_ranges

FOLDER = Path(benchbot_assets_household.__file__).parent
CATALOGUE: Catalogue = load_catalogue(FOLDER / "catalogue.json")
VARYING = [model for model in CATALOGUE.models.values() if model.varies is not None]


def test_nine_in_ten_models_vary() -> None:
    assert len(VARYING) > 0.9 * len(CATALOGUE.models)


def test_what_fills_openings_does_not_vary() -> None:
    assert not [model.id for model in VARYING if model.placement == "opening"]


def test_every_variation_has_a_real_size() -> None:
    for model in VARYING:
        ranges = size_ranges().get(model.kind) or size_ranges().get(model.class_name or "")
        for number in range(1, VARIATIONS, 7):
            x, y, z = model.variation(number).size_m
            for value, (least, most) in zip((max(x, y), min(x, y), z), ranges or (), strict=False):
                assert least <= value <= most, (model.id, number)


def test_what_is_turned_stays_round() -> None:
    turned = {"cup", "bowl", "plate", "bottle", "vase", "wine glass", "wall clock"}
    for model in VARYING:
        x, y, z = model.variation(7).scale
        assert model.kind not in turned or (y == z if model.placement == "wall" else x == y), model.id


def test_surfaces_lie_within_the_box_of_every_variation() -> None:
    for model in VARYING:
        for variation in (model.variation(number) for number in range(1, 60)):
            half_x, half_y = variation.size_m[0] / 2 + 1e-4, variation.size_m[1] / 2 + 1e-4
            for surface in variation.surfaces:
                assert -half_x <= surface.low_m[0] < surface.high_m[0] <= half_x, variation.id
                assert -half_y <= surface.low_m[1] < surface.high_m[1] <= half_y, variation.id
                assert 0 < surface.z_m <= variation.size_m[2] + 0.001, variation.id


def test_every_palette_is_of_looks_that_are_there_and_is_used() -> None:
    document, _ = split_glb((FOLDER / LOOKS).read_bytes())
    names = {entry["name"] for entry in document["materials"]} | {OWN, None}
    palettes = {palette for model in VARYING if model.varies for palette in model.varies.palettes if palette}
    assert {finish.texture for palette in palettes for finish in palette.finishes} <= names
    assert names - {finish.texture for palette in palettes for finish in palette.finishes} == set()


def test_textures_are_put_only_where_texture_coordinates_are() -> None:
    for model in VARYING:
        document, _ = split_glb(model.file.read_bytes())
        assert model.varies is not None
        assert len(model.varies.palettes) == len(document["materials"]), model.id
        for mesh in document["meshes"]:
            for part in mesh["primitives"]:
                palette = model.varies.palettes[part["material"]]
                if palette is not None and any(finish.texture not in (None, OWN) for finish in palette.finishes):
                    assert "TEXCOORD_0" in part["attributes"], (model.id, palette.name)


@pytest.mark.parametrize("model", VARYING, ids=lambda model: model.id)
def test_a_variation_can_be_shown(model: AssetModel) -> None:
    """In three variations side by side: with the box that the catalogue says, and in what it is finished with."""
    chosen = [model.variation(number) for number in (1, 2, 500)]
    placed = tuple(Placement(f"{n}", one.id, (10.0 * n, 0.0, 0.0)) for n, one in enumerate(chosen))
    scene = geometry_of(GltfFile(*split_glb(compose(Layout("household", None, placed)))))[0]
    for instance, one in zip(scene.instances, chosen, strict=True):
        own = scene.triangle_instance == instance.index
        np.testing.assert_allclose(
            np.ptp(scene.vertices[scene.triangles[own]].reshape(-1, 3), axis=0), one.size_m, atol=0.0015
        )


def test_pictures_and_covers_come_in_hundreds() -> None:
    palettes = {
        palette.name: palette for model in VARYING if model.varies for palette in model.varies.palettes if palette
    }
    assert len(palettes["prints upright"].finishes) + len(palettes["prints lying"].finishes) > 300
    # A cover comes in four levels of wear.
    assert 4 * len(palettes["jackets"].finishes) > 300
