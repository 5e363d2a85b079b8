"""The pack of Sweet Home 3D's furniture, from libraries that a test makes and from the real ones."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError
from benchbot_scenes.catalogue import load_catalogue, pack
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.packs import folder, sweethome3d
from benchbot_scenes.packs.sweethome3d import Wanted, install
from plugins.scenes.tests.asset_packs.furniture import box, deb, entry, sh3f

CLASSES = {
    *("bottle", "cup", "knife", "bowl", "wine glass", "fork", "spoon", "banana", "apple", "orange", "cake"),
    *("potted plant", "mouse", "keyboard", "laptop", "cell phone", "book", "clock", "chair", "table", "couch", "bed"),
    *("toilet", "tv", "microwave", "toaster", "refrigerator", "oven", "sink", "person"),
}


def in_order(models: Sequence[Wanted]) -> Sequence[Wanted]:
    return models


def library(tmp_path: Path) -> Path:
    lines = entry(1, "Scopia#chair") + entry(2, "Scopia#table4", dropOnTopElevation="66")
    lines += entry(3, "Scopia#small_lavatory", elevation="50") + entry(4, "Scopia#bus")
    files = {key: data for name in ("chair", "table4", "small_lavatory", "bus") for key, data in box(name).items()}
    return sh3f(tmp_path / "Scopia.sh3f", lines, files)


def test_the_models_that_are_known_become_a_pack(tmp_path: Path) -> None:
    done = install(library(tmp_path), in_order)

    models = pack("sweethome3d").models
    assert (done.models, done.left_out) == (3, ())
    assert {id_: (model.class_name, model.placement) for id_, model in models.items()} == {
        "scopia_chair": ("chair", "floor"),
        "scopia_table4": ("table", "floor"),
        "scopia_small_lavatory": ("sink", "wall"),
    }
    assert models["scopia_table4"].surfaces[0].z_m == 0.66
    assert models["scopia_chair"].author == "Ren\xe9"
    assert models["scopia_chair"].licence == "CC-BY-3.0"
    text = (done.path / "CREDITS.txt").read_text("utf-8")
    assert "scopia_chair: by Ren\xe9, CC-BY-3.0, sweethome3d-furniture: Scopia#chair (Chair)" in text


def test_a_model_faces_along_x_on_the_ground_at_its_catalogues_size(tmp_path: Path) -> None:
    install(library(tmp_path), in_order)

    model = pack("sweethome3d").model("scopia_chair")
    scene = load_scene(model.file)

    assert model.size_m == (0.6, 0.5, 0.7)
    assert np.allclose(scene.vertices.min(axis=0), (-0.3, -0.25, 0.0), atol=1e-6)
    assert np.allclose(scene.vertices.max(axis=0), (0.3, 0.25, 0.7), atol=1e-6)
    assert [(instance.name, instance.class_name) for instance in scene.instances] == [("scopia_chair", "chair")]
    assert [image.shape for image in scene.images] == [(512, 4, 4)]
    assert [material.is_glass for material in scene.materials[:2]] == [False, True]
    corners = scene.vertices[scene.triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", facing, scene.normals[scene.triangles[:, 0]]) > 0).all()


def test_parts_of_a_model_keep_their_size(tmp_path: Path) -> None:
    obj = box("apples")["models/apples/apples.obj"].replace(b"o lid", b"o apple2.003_lid")
    path = sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#apples"), {**box("apples"), "models/apples/apples.obj": obj})

    install(path, in_order)

    (apple,) = pack("sweethome3d").models.values()
    assert (apple.id, apple.class_name, apple.triangles) == ("scopia_apples", "apple", 4)
    assert apple.size_m == (0.6, 0.5, 0.7)


def test_a_package_a_folder_and_a_library_give_the_same_pack(tmp_path: Path) -> None:
    source = library(tmp_path)
    package = deb(tmp_path / "f.deb", {"usr/share/sweethome3d/furniture/Scopia.sh3f": source.read_bytes()})
    made = []
    for path in (source, package, tmp_path):
        done = install(path, in_order)
        made.append({file.name: file.read_bytes() for file in done.path.rglob("*") if file.is_file()})
        folder.remove("sweethome3d")

    assert made[0] == made[1] == made[2]
    assert "scopia_chair.glb" in made[0]


def test_a_model_that_cannot_be_used_is_named_and_does_not_take_the_others_down(tmp_path: Path) -> None:
    files = {**box("chair"), **box("table4"), "models/table4/table4.obj": b"v 0 0 0\n"}
    path = sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#chair") + entry(2, "Scopia#table4"), files)

    done = install(path, in_order)

    assert done.models == 1
    (line,) = done.left_out
    assert line.startswith("Scopia#table4: table4.obj holds no triangles")


def test_nothing_is_left_of_an_installation_that_fails(tmp_path: Path) -> None:
    path = sh3f(tmp_path / "a.sh3f", entry(1, "Scopia#bus"), box("bus"))

    with pytest.raises(BenchbotError, match="None of the models"):
        install(path, in_order)

    assert folder.installed() == {}
    assert list((tmp_path / "data/assets").iterdir()) == []


def test_a_pack_is_not_replaced_unasked(tmp_path: Path) -> None:
    install(library(tmp_path), in_order)

    with pytest.raises(BenchbotError, match="already installed") as caught:
        install(library(tmp_path), in_order)
    assert caught.value.fix.endswith("benchbot assets remove sweethome3d")


def test_an_installed_pack_is_offered_until_it_is_removed(tmp_path: Path) -> None:
    loaded = plugin_manager.Plugins(plugin_manager.installed())
    assert "sweethome3d" not in loaded.pool("asset_packs")
    done = install(library(tmp_path), in_order)
    assert loaded.pool("asset_packs")["sweethome3d"].value.catalogue == done.path / "catalogue.json"

    assert folder.remove("sweethome3d") == done.path
    assert "sweethome3d" not in loaded.pool("asset_packs")
    with pytest.raises(BenchbotError, match="not an asset pack that you have installed"):
        folder.remove("sweethome3d")


def test_where_there_can_be_no_data_folder_there_are_no_packs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_DATA_DIR", "/proc/no_such_folder")

    assert folder.installed() == {}


def test_the_table_names_known_classes_only() -> None:
    table = sweethome3d._table()
    said = [each for library in table.values() for each in library.values()]
    said = [one for each in said for one in (each if isinstance(each, list) else [each])]
    named = {one if isinstance(one, str) else one.get("class") for one in said} - {None}

    assert named == CLASSES - {"mouse"}


@pytest.mark.slow
def test_the_real_package_covers_29_classes(tmp_path: Path) -> None:
    done = install(None, in_order)

    catalogue = load_catalogue(done.path / "catalogue.json")
    document = json.loads((done.path / "catalogue.json").read_text("utf-8"))
    assert done.left_out == ()
    assert {model.class_name for model in catalogue.models.values()} - {None} == CLASSES - {"mouse"}
    assert {entry["licence"] for entry in document["models"]} == {"CC0-1.0", "CC-BY-3.0", "CC-BY-3.0-US"}
    for model in catalogue.models.values():
        vertices = load_scene(model.file).vertices
        assert np.allclose(vertices.max(axis=0) - vertices.min(axis=0), model.size_m, atol=1e-3), model.id
        assert np.allclose((vertices.max(axis=0) + vertices.min(axis=0))[:2], 0.0, atol=1e-4), model.id
        assert abs(vertices[:, 2].min()) < 1e-4, model.id
        assert max(model.size_m) < 3.0, model.id
