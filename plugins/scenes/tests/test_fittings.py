"""Doors and windows in their openings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.catalogue import Catalogue
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.layout import Layout, Opening
from benchbot_scenes.scene import SceneGeometry
from plugins.scenes.tests import packs
from plugins.scenes.tests.plans import DOOR, WINDOW, two_rooms


@pytest.fixture
def blocks(tmp_path: Path) -> Catalogue:
    return packs.pack(tmp_path / "blocks")


def with_opening(folder: Path, blocks: Catalogue, opening: Opening) -> SceneGeometry:
    path = folder / "scene.glb"
    path.write_bytes(compose(Layout("blocks", two_rooms(opening)), {"blocks": blocks}))
    return load_scene(path)


def corners(scene: SceneGeometry, name: str) -> np.ndarray:
    index = next(instance.index for instance in scene.instances if instance.name == name)
    return np.asarray(scene.vertices[np.unique(scene.triangles[scene.triangle_instance == index])])


def test_a_closed_door_fills_its_opening_flush_with_the_room_that_it_opens_to(
    tmp_path: Path, blocks: Catalogue
) -> None:
    wide = replace(DOOR, width_m=1.0, top_m=2.1)
    door = corners(with_opening(tmp_path, blocks, wide), wide.name)
    assert door.min(axis=0) == pytest.approx([4.0, 0.5, 0.0], abs=2e-3)
    assert door.max(axis=0) == pytest.approx([4.1, 1.5, 2.1], abs=2e-3)


@pytest.mark.parametrize(("open_deg", "hinge_y"), [(90.0, 1.42), (-90.0, 0.58)])
def test_an_open_leaf_stands_in_the_room_at_its_hinge(
    tmp_path: Path, blocks: Catalogue, open_deg: float, hinge_y: float
) -> None:
    """The room is west of the door, so its model faces -x, and its -y, the hinge, lies to the north."""
    opened = replace(DOOR, open_deg=open_deg)
    door = corners(with_opening(tmp_path, blocks, opened), opened.name)
    top = door[np.isclose(door[:, 2], 1.97, atol=2e-3)]  # without the handle
    assert top[:, 0].min() == pytest.approx(4.03 - 0.84, abs=2e-3)
    assert top[:, 0].max() == pytest.approx(4.03, abs=2e-3)
    assert np.abs(top[:, 1] - hinge_y).max() < 0.045


def test_a_half_open_leaf_keeps_its_width(tmp_path: Path, blocks: Catalogue) -> None:
    ajar = replace(DOOR, open_deg=30.0)
    door = corners(with_opening(tmp_path, blocks, ajar), ajar.name)
    top = door[np.isclose(door[:, 2], 1.97, atol=2e-3)]
    assert 4.03 - top[:, 0].min() == pytest.approx(0.84 * 0.5, abs=2e-3)


def test_a_window_sits_towards_the_outside_and_looks_in(tmp_path: Path, blocks: Catalogue) -> None:
    window = corners(with_opening(tmp_path, blocks, WINDOW), WINDOW.name)
    assert window.min(axis=0) == pytest.approx([1.4, -0.23, 0.8], abs=2e-3)
    assert window.max(axis=0) == pytest.approx([2.6, -0.15, 2.1], abs=2e-3)
    front = window[window[:, 1] > -0.151]
    assert np.abs(front[:, 0] - 2.0).max() < 0.011


def test_a_door_may_name_its_model(tmp_path: Path, blocks: Catalogue) -> None:
    named = replace(DOOR, model="chair")
    assert corners(with_opening(tmp_path, blocks, named), named.name)[:, 2].max() == pytest.approx(2.0, abs=2e-3)
    with pytest.raises(BenchbotError, match="no model 'doo'"):
        with_opening(tmp_path, blocks, replace(DOOR, model="doo"))


def test_without_a_model_of_its_kind_an_opening_stays_empty(tmp_path: Path, blocks: Catalogue) -> None:
    front_door = replace(DOOR, at=(-0.1, 1.5))  # the pack has interior doors only
    names = {instance.name for instance in with_opening(tmp_path, blocks, front_door).instances}
    assert front_door.name not in names
    assert f"reveal {front_door.name}" in names
