"""Pictures in one launch: the kernels of a GPU and of the quality `fast`, on a CPU."""

from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi.frames import DeviceFrames
from benchbot_sim_taichi.intrinsics import camera_records
from benchbot_sim_taichi.kernels import first_hits, glance
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import FAST, REALTIME
from benchbot_sim_taichi.renderer import Frame, Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")

SMALL = Intrinsics.from_horizontal_fov(48, 32, 90.0)
ODD = Intrinsics.from_horizontal_fov(45, 31, 90.0)
POSES = np.stack([looking((0.6, 0.4, 1.1), 50.0), looking((2.9, 0.5, 0.9), 120.0, -10.0), np.full((4, 4), np.nan)])
BEFORE_THE_FENCE = np.stack([looking((x, 0.05, 1.0), yaw) for x, yaw in ((0.0, 0.0), (0.0, -20.0), (1.4, 0.0))])


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> dict[str, Renderer]:
    scene = load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))
    return {
        quality.name: Renderer(scene, Lighting(), cache_dir=kernel_cache, quality=quality)
        for quality in (FAST, REALTIME)
    }


@pytest.fixture(scope="module")
def fence(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> Renderer:
    scene = load_scene(rooms.fence(tmp_path_factory.mktemp("fence") / "fence.glb"))
    return Renderer(scene, Lighting(), cache_dir=kernel_cache)


def see(renderer: Renderer, poses: np.ndarray, camera: Intrinsics, *, has_sheer: bool = True) -> list[Frame]:
    """Depth and instances by the kernel that a GPU uses."""
    device, size = renderer.device, (len(poses), camera.width, camera.height)
    frames = DeviceFrames.allocate(*size, has_rgb=False)
    records = camera_records(poses, camera)
    places = (frames.depth_at(0), frames.instance_at(0))
    scene = (*device.tree, device.sheer_root, *device.surfaces)
    hits = np.empty(first_hits.hits_size(*size), np.float32)
    first_hits.meet_squares(*device.tree, device.sheer_root, records.ravel(), hits, *size)
    glance.see(*scene, records, hits, frames.words, *places, *size, has_sheer)
    batch = frames.to_host()
    return [batch[index] for index in range(len(batch))]


def assert_same_shapes(one: Frame, other: Frame) -> None:
    assert np.array_equal(one.instance, other.instance)
    np.testing.assert_allclose(one.depth_m, other.depth_m, atol=1e-4)


@pytest.mark.parametrize("camera", [SMALL, ODD], ids=["whole tiles", "cut tiles"])
def test_a_glance_sees_what_a_long_look_sees(room: dict[str, Renderer], camera: Intrinsics) -> None:
    for one, pose in zip(see(room["realtime"], POSES, camera), POSES, strict=True):
        assert_same_shapes(one, room["realtime"].render(pose, camera, rgb=False))


def test_panes_and_holes_are_seen_at_a_glance(fence: Renderer) -> None:
    found = see(fence, BEFORE_THE_FENCE, ODD)
    assert len(np.unique([one.instance for one in found])) == 3  # pane, card, and the wall behind its hole
    for one, pose in zip(found, BEFORE_THE_FENCE, strict=True):
        assert_same_shapes(one, fence.render(pose, ODD, rgb=False))


def test_a_scene_without_sheer_things_needs_no_second_look(room: dict[str, Renderer]) -> None:
    away_from_the_window = POSES[:1] @ np.diag([-1.0, 1.0, -1.0, 1.0])
    with_look, without = (see(room["realtime"], away_from_the_window, SMALL, has_sheer=way)[0] for way in (True, False))
    assert_same_shapes(with_look, without)


@pytest.mark.parametrize("camera", [SMALL, ODD], ids=["whole groups", "cut groups"])
def test_fast_pictures_do_not_depend_on_their_batch(room: dict[str, Renderer], camera: Intrinsics) -> None:
    batch = room["fast"].render_batch(POSES, camera)
    for index, pose in enumerate(POSES):
        alone = room["fast"].render(pose, camera)
        assert batch.rgb[index].tobytes() == alone.rgb.tobytes()
        assert batch.depth_m[index].tobytes() == alone.depth_m.tobytes()


def test_fast_changes_nothing_but_colours(room: dict[str, Renderer]) -> None:
    fast, full = (room[name].render_batch(POSES, SMALL) for name in ("fast", "realtime"))
    assert fast.depth_m.tobytes() == full.depth_m.tobytes()
    assert fast.instance.tobytes() == full.instance.tobytes()


def test_fast_colours_are_close_to_those_of_realtime(room: dict[str, Renderer]) -> None:
    """The table and the steel kettle mirror nothing, and edges are jagged."""
    fast, full = (room[name].render_batch(POSES[:2], SMALL).rgb / 255.0 for name in ("fast", "realtime"))
    assert np.sqrt(((fast - full) ** 2).mean()) < 0.1
    assert np.abs((fast - full).mean(axis=(1, 2))).max() < 0.05
