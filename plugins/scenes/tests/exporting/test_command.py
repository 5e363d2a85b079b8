"""`benchbot export` as a person uses it."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest
import yaml

from benchbot.cli.app import main
from benchbot.core import plugin_manager
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.importing.guesses import beside
from benchbot_scenes.importing.understanding import understand
from plugins.scenes.tests.exporting import opened, rooms
from plugins.scenes.tests.test_splats import cloud
from tests.garbage import searched_as_before


@pytest.fixture(autouse=True)
def process(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Leave the process as it was: --addons is handed on by a variable, and plug-ins are loaded once."""
    monkeypatch.setenv("BENCHBOT_ADDONS", "")
    with searched_as_before():
        yield
    plugin_manager.load.cache_clear()


@pytest.fixture
def addon(tmp_path: Path) -> Path:
    """An add-on with a room, as `import-environment` makes them, that is hidden."""
    (tmp_path / "environments").mkdir()
    rooms.labelled(tmp_path)
    declaration = {
        "name": "cell",
        "variant": 1,
        "type": "sim_taichi",
        "map_path": "../room.glb",
        "hidden": True,
        "start_pose": [1, 0, 0, 0, 2, 1, 0],
        "object_labels": ["table"],
    }
    (tmp_path / "environments" / "cell_1.yaml").write_text(yaml.safe_dump(declaration))
    return tmp_path


def _run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["export", *words])
    return int(ended.value.code or 0)


def test_splats_are_kept_or_said_to_be_left_out(addon: Path, capsys: pytest.CaptureFixture[str]) -> None:
    room = addon / "room.glb"
    room.write_bytes(to_glb(replace(load_scene(room), splats=cloud(0))))
    words = ["--addons", str(addon), "cell:1", "--with-hidden"]
    assert _run(*words, "--to", "gltf", "-o", str(addon / "gltf")) == 0
    assert "splats" not in capsys.readouterr().err
    assert load_scene(addon / "gltf" / "cell_1.glb").splats is not None
    assert _run(*words, "--to", "mjcf", "-o", str(addon / "mjcf")) == 0
    assert "splats of cell:1 are left out of mjcf" in " ".join(capsys.readouterr().err.split())


def test_miniroom_is_the_same_scene_as_gltf_and_in_mujoco(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["miniroom:1", "--output", str(tmp_path), "--with-ground-truth"]
    assert _run(*words, "--to", "gltf", "--json") == 0
    glb, guesses, truth = (Path(path) for path in json.loads(capsys.readouterr().out))
    assert (glb.name, guesses.name, truth.name) == (
        "miniroom_1.glb",
        "miniroom_1.import.yaml",
        "miniroom_1.ground_truth.json",
    )
    objects = json.loads(truth.read_text())["ground_truth"]["objects"]
    again = understand(glb, beside(glb)).geometry
    assert {entry["ID_name"]: entry["class"] for entry in objects} == {
        found.name: found.class_name for found in again.instances if found.class_name is not None
    }
    assert _run(*words[:1], "--to", "mjcf", *words[1:2], str(tmp_path / "mjcf"), "--with-ground-truth") == 0
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "mjcf" / "miniroom_1.xml"))
    assert rooms.apart_m(rooms.boxes(again), opened.mujoco_boxes(model, opened.VISUAL)) <= 0.001


def test_no_name_or_class_is_told_unless_it_is_asked_for(tmp_path: Path, addon: Path) -> None:
    for to in ("gltf", "mjcf", "sdf", "usd"):
        assert _run("--addons", str(addon), "cell:1", "--to", to, "-o", str(tmp_path / to), "--with-hidden") == 0
    files = {
        path.relative_to(tmp_path): path
        for to in ("gltf", "mjcf", "sdf", "usd")
        for path in (tmp_path / to).rglob("*.*")
    }
    told = (
        b"".join([str(name).encode() + path.read_bytes() for name, path in files.items()])
        .lower()
        .replace(b"albedo", b"")
    )
    for word in (b"chair", b"table", b"bed", b"cup", b"mug", b"wall", b"ceiling", b'floor"', b"ground_truth"):
        assert word not in told
    scene = load_scene(tmp_path / "gltf" / "cell_1.glb")
    assert {found.class_name for found in scene.instances} == {None}


def test_a_hidden_place_is_not_exported_by_mistake(
    tmp_path: Path, addon: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run("--addons", str(addon), "cell:1", "--to", "gltf", "-o", str(tmp_path / "out")) == 2
    assert "--with-hidden" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_mistakes_are_explained_and_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run("miniroom:1", "--to", "gltff") == 2
    told = capsys.readouterr().err
    assert "gltf, mjcf, sdf, usd" in told
    assert "Did you mean 'gltf'" in told
    mine = tmp_path / "miniroom_1.import.yaml"
    mine.write_text("mine")
    assert _run("miniroom:1", "--to", "gltf", "-o", str(tmp_path)) == 2
    assert "there already" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == [mine.name]
    assert mine.read_text() == "mine"
