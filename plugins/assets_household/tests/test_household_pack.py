"""The committed pack: what its catalogue says of a model is what the file holds."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import benchbot_assets_household
from benchbot_assets_household import plugin
from benchbot_scenes.catalogue import AssetModel, load_catalogue
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry

FOLDER = Path(benchbot_assets_household.__file__).parent
CATALOGUE = load_catalogue(FOLDER / "catalogue.json")
CLASSES = {
    *("bottle", "cup", "knife", "bowl", "wine glass", "fork", "spoon", "banana", "apple", "orange", "cake"),
    *("potted plant", "mouse", "keyboard", "laptop", "cell phone", "book", "clock", "chair", "table", "couch", "bed"),
    *("toilet", "tv", "microwave", "toaster", "refrigerator", "oven", "sink", "person"),
}
KINDS = {
    *("door", "interior door", "window", "floor lamp", "table lamp", "pendant lamp", "ceiling lamp", "rug", "curtain"),
    *("picture", "shelf", "bookcase", "wardrobe", "chest of drawers", "sideboard", "bedside table", "kitchen counter"),
    *("desk", "stove", "radiator", "mirror", "bathtub", "shower", "basket", "cushion", "office cabinet", "whiteboard"),
    *("coat rack", "plant stand", "shoes", "magnets", "bin", "paper", "charger", "power strip", "desk cables"),
}
LICENCES = {"BSD-3-Clause"}


@pytest.fixture(params=sorted(CATALOGUE.models), scope="module")
def model(request: pytest.FixtureRequest) -> AssetModel:
    return CATALOGUE.model(request.param)


@pytest.fixture(scope="module")
def scene(model: AssetModel) -> SceneGeometry:
    return load_scene(model.file)


def test_the_box_and_the_origin_are_as_agreed(model: AssetModel, scene: SceneGeometry) -> None:
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    np.testing.assert_allclose(high - low, model.size_m, atol=0.001)
    np.testing.assert_allclose((low + high)[:2] / 2, 0.0, atol=0.001)
    assert low[2] == pytest.approx(0.0, abs=0.001)


def test_triangles_are_as_many_as_the_catalogue_says(model: AssetModel, scene: SceneGeometry) -> None:
    assert len(scene.triangles) == model.triangles
    assert 12 <= model.triangles <= 15_000


def test_normals_look_the_way_that_triangles_face(scene: SceneGeometry) -> None:
    corners = scene.vertices[scene.triangles].astype(float)
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    against = (facing * scene.normals[scene.triangles].mean(axis=1)).sum(axis=1) < 0
    area = np.linalg.norm(facing, axis=1)
    assert area[against].sum() <= 0.01 * area.sum()


def test_few_triangles_glow(scene: SceneGeometry) -> None:
    assert sum(scene.materials[index].is_emissive for index in scene.triangle_material) <= 200


def test_surfaces_lie_within_the_box() -> None:
    for model in CATALOGUE.models.values():
        half_x, half_y = model.size_m[0] / 2, model.size_m[1] / 2
        for surface in model.surfaces:
            assert -half_x <= surface.low_m[0] < surface.high_m[0] <= half_x, model.id
            assert -half_y <= surface.low_m[1] < surface.high_m[1] <= half_y, model.id
            assert 0 < surface.z_m <= model.size_m[2] + 0.001, model.id
            assert surface.headroom_m > 0, model.id


def test_where_it_comes_from_is_said() -> None:
    for model in CATALOGUE.models.values():
        assert model.licence in LICENCES, model.id
        assert model.author, model.id
        assert model.source, model.id


def test_every_class_has_three_models() -> None:
    count = Counter(model.class_name for model in CATALOGUE.models.values())
    assert {name: count[name] for name in CLASSES if count[name] < 3} == {}
    assert set(count) == {*CLASSES, None}


def test_every_kind_is_there() -> None:
    assert {model.kind for model in CATALOGUE.models.values()} >= KINDS


def test_doors_have_a_leaf_to_turn() -> None:
    for model in CATALOGUE.models.values():
        if model.kind in ("door", "interior door"):
            leaf = [item for item in load_scene(model.file).instances if item.name == "leaf"]
            assert len(leaf) == 1, model.id


def test_each_file_is_listed_once_and_all_are_small() -> None:
    files = [model.file for model in CATALOGUE.models.values()]
    assert sorted(files) == sorted((FOLDER / "models").glob("*.glb"))
    assert sum(path.stat().st_size for path in files) <= 13_000_000


def test_the_plugin_offers_the_pack() -> None:
    (pack,) = plugin.benchbot_asset_packs()
    assert (pack.name, pack.catalogue) == ("household", FOLDER / "catalogue.json")


def test_importing_the_plugin_stays_light() -> None:
    code = (
        "import sys, benchbot_assets_household.plugin; print({'numpy', 'PIL', 'pygltflib', 'scipy'} & set(sys.modules))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "set()"


def test_the_catalogue_is_plain_json() -> None:
    document = json.loads((FOLDER / "catalogue.json").read_text(encoding="utf-8"))
    assert document["version"] == 1
    assert [entry["id"] for entry in document["models"]] == sorted(CATALOGUE.models)
