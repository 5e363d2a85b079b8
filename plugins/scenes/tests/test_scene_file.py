"""Scene files that are composed once and kept."""

from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes import catalogue
from benchbot_scenes.catalogue import Catalogue
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.layout import Building, Layout, Placement, write_layout
from benchbot_scenes.scene_file import scene_file
from plugins.scenes.tests import packs
from plugins.scenes.tests.plans import WEST


@pytest.fixture
def blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Catalogue:
    """A pack that is installed."""
    made = packs.pack(tmp_path / "blocks")
    others = packs.pack(tmp_path / "others", "others")
    monkeypatch.setattr(catalogue, "pack", {"blocks": made, "others": others}.__getitem__)
    return made


@pytest.fixture
def layout(tmp_path: Path, blocks: Catalogue) -> Path:
    chair = Placement("chair 1", "chair", (1.0, 2.0, 0.0))
    write_layout(tmp_path / "room.yaml", Layout(blocks.name, Building(2.5, 0.3, (WEST,), ()), (chair,)))
    return tmp_path / "room.yaml"


def test_a_scene_file_is_taken_as_it_is(tmp_path: Path) -> None:
    assert scene_file(tmp_path / "room.glb", tmp_path) == tmp_path / "room.glb"


def test_a_layout_is_composed_once(tmp_path: Path, layout: Path) -> None:
    first = scene_file(layout, tmp_path / "cache")
    made = first.stat()
    assert "chair 1" in {instance.name for instance in load_scene(first).instances}
    assert scene_file(layout, tmp_path / "cache") == first
    assert (first.stat().st_ino, first.stat().st_mtime_ns) == (made.st_ino, made.st_mtime_ns)
    assert list(first.parent.iterdir()) == [first]


@pytest.mark.parametrize("at", [30, -100, -10])
def test_a_damaged_file_is_composed_again(tmp_path: Path, layout: Path, at: int) -> None:
    path = scene_file(layout, tmp_path)
    whole = path.read_bytes()
    broken = bytearray(whole)
    broken[at] ^= 1
    for damaged in (bytes(broken), whole[:-at], b""):
        path.write_bytes(damaged)
        assert scene_file(layout, tmp_path).read_bytes() == whole


def test_what_it_is_made_of_decides_where_it_is_kept(tmp_path: Path, layout: Path, blocks: Catalogue) -> None:
    made = {scene_file(layout, tmp_path)}
    packs.write(blocks.model("chair").file, {"chair": packs.facing_x((0.5, 0.4, 0.9))}, (0.9, 0.1, 0.1))
    made.add(scene_file(layout, tmp_path))
    made.add(scene_file(layout, tmp_path, assets="others"))
    layout.write_text(layout.read_text().replace("2.5", "2.6"))
    made.add(scene_file(layout, tmp_path))
    assert len(made) == 4


def test_a_cache_that_cannot_be_used_is_named(tmp_path: Path, layout: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BenchbotError, match="cannot be kept in") as caught:
        scene_file(layout, tmp_path / "file")
    assert "BENCHBOT_CACHE_DIR" in caught.value.fix


def test_a_file_of_no_known_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "room.doc").write_text("a room")
    with pytest.raises(BenchbotError, match=r"room\.doc"):
        scene_file(tmp_path / "room.doc", tmp_path)
