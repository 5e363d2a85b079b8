"""Switching and tuning the lamps of a scene."""

from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import lamps, lights
from benchbot_sim_taichi.colorimetry import LUMINANCE
from benchbot_sim_taichi.lamps import Lamps
from plugins.sim_taichi.tests.glb import Glb

NO_PANES = np.zeros(0, np.int32)


@pytest.fixture
def room(tmp_path: Path) -> SceneGeometry:
    """Two lamps of one material, and a screen whose left half glows."""
    glb = Glb()
    bulb = glb.material(emission=(4.0, 2.0, 1.0))
    glb.box("desk lamp", (0, 0, 0), (1, 1, 1), bulb)
    glb.box("ceiling lamp", (3, 0, 0), (4, 1, 1), bulb)
    image = np.zeros((8, 8, 3), np.uint8)
    image[:, :4] = 255
    corners = np.array([[0, 5, 0], [1, 5, 0], [1, 5, 1], [0, 5, 1]], float)
    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], float)
    screen = glb.material(emission=(2.0, 2.0, 2.0), glow_image=image)
    glb.add("screen", corners, np.array([[0, 1, 2], [0, 2, 3]]), screen, uvs=uvs)
    glb.box("table", (0, 0, -2), (1, 1, -1), glb.material())
    return load_scene(glb.write(tmp_path / "room.glb"))


def power(scene: SceneGeometry, name: str) -> np.ndarray:
    """Radiance times area of an instance's lamps."""
    table = lights.light_table(scene, NO_PANES)
    (index,) = (instance.index for instance in scene.instances if instance.name == name)
    mine = table.of_triangle[(scene.triangle_instance == index) & (table.of_triangle >= 0)]
    records = table.records.reshape(-1, lights.LIGHT_STRIDE)[mine]
    area = 0.5 * np.linalg.norm(np.cross(records[:, 3:6], records[:, 6:9]), axis=1)
    total: np.ndarray = (records[:, 14:17] * area[:, None]).sum(axis=0)
    return total


def test_every_instance_that_glows_is_a_lamp(room: SceneGeometry) -> None:
    assert lamps.names(room) == ["ceiling lamp", "desk lamp", "screen"]


def test_left_alone_a_scene_stays_what_it_is(room: SceneGeometry) -> None:
    assert lamps.switched(room, Lamps()) is room


def test_lamps_that_share_a_material_are_switched_each_for_itself(room: SceneGeometry) -> None:
    lit = lamps.switched(room, Lamps(on=("desk lamp",)))
    assert power(lit, "desk lamp") == pytest.approx([24.0, 12.0, 6.0])
    assert power(lit, "ceiling lamp").size == 3
    assert not power(lit, "ceiling lamp").any()
    assert lit.content_hash != room.content_hash


def test_all_lamps_go_out(room: SceneGeometry) -> None:
    dark = lamps.switched(room, Lamps(on=()))
    assert lamps.names(dark) == []
    assert lights.light_table(dark, NO_PANES).lamps == 0


def test_a_colour_temperature_keeps_brightness_and_scale_changes_it(room: SceneGeometry) -> None:
    lit = lamps.switched(room, Lamps(temperature_k=2700.0, scale=0.5))
    before, after = power(room, "desk lamp"), power(lit, "desk lamp")
    assert LUMINANCE @ after == pytest.approx(0.5 * LUMINANCE @ before)
    assert after[0] / after[2] > 5


def test_a_screen_sends_the_mean_of_its_picture(room: SceneGeometry) -> None:
    assert power(room, "screen") == pytest.approx(np.full(3, 1.0), rel=0.15)


def test_a_lamp_that_is_not_there_is_named(room: SceneGeometry) -> None:
    with pytest.raises(BenchbotError, match=r"lighting.lamps.on\[1\].*'desk lamb'") as caught:
        lamps.check(room, Lamps(on=("screen", "desk lamb")))
    assert "desk lamp" in caught.value.fix
