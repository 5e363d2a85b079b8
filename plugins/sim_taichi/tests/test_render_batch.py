"""Pictures of many cameras, taken together."""

import ctypes
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import _ti, renderer
from benchbot_sim_taichi.frames import DeviceArray
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Frame, Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")

SMALL = Intrinsics.from_horizontal_fov(48, 32, 90.0)
ODD = Intrinsics.from_horizontal_fov(15, 9, 70.0)
INSIDE_A_WALL = looking((-0.05, 1.5, 1.0), 30.0)
OUTSIDE = looking((2.0, 8.0, 1.5), -90.0)
NOWHERE = np.full((4, 4), np.nan)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> Renderer:
    scene = load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))
    return Renderer(scene, Lighting(), cache_dir=kernel_cache)


def around(count: int) -> np.ndarray:
    """Poses on a curve through the room, looking everywhere."""
    step = np.arange(count)
    return np.stack(
        [looking((0.6 + 2.6 * (k * 0.37 % 1), 0.4 + 0.7 * (k * 0.61 % 1), 1.1), 47.0 * k, -8.0 * (k % 4)) for k in step]
    )


def assert_same(one: Frame, other: Frame) -> None:
    assert one.depth_m.tobytes() == other.depth_m.tobytes()
    assert one.instance.tobytes() == other.instance.tobytes()
    assert one.rgb.tobytes() == other.rgb.tobytes()


@pytest.mark.parametrize("intrinsics", [SMALL, ODD], ids=["even", "odd"])
@pytest.mark.parametrize("count", [1, 3, 17])
def test_a_batch_has_the_bytes_of_single_pictures(room: Renderer, count: int, intrinsics: Intrinsics) -> None:
    poses = around(count)

    batch = room.render_batch(poses, intrinsics)

    assert len(batch) == count
    assert batch.rgb.shape == (count, intrinsics.height, intrinsics.width, 3)
    assert [str(values.dtype) for values in (batch.rgb, batch.depth_m, batch.instance)] == ["uint8", "float32", "int32"]
    assert len({batch.rgb[index].tobytes() for index in range(count)}) == count
    for index, pose in enumerate(poses):
        assert_same(batch[index], room.render(pose, intrinsics))


def test_a_camera_is_not_disturbed_by_its_neighbours(room: Renderer) -> None:
    """Light samples, edges and bloom are shared between pixels: never across the border of a picture."""
    pose = looking((0.6, 0.4, 1.05), 50.0)
    alone = room.render(pose, SMALL)

    batch = room.render_batch(np.stack([INSIDE_A_WALL, pose, NOWHERE, pose, OUTSIDE, pose]), SMALL)

    for index in (1, 3, 5):
        assert_same(batch[index], alone)
    assert_same(batch[0], room.render(INSIDE_A_WALL, SMALL))
    assert_same(batch[4], room.render(OUTSIDE, SMALL))
    assert np.isposinf(batch.depth_m[2]).all()
    assert not batch.instance[2].any()


def test_a_large_batch_is_taken_in_parts(room: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    poses = around(7)
    whole = room.render_batch(poses, ODD)
    monkeypatch.setattr(renderer, "PIXELS_AT_ONCE", 3 * ODD.width * ODD.height)

    parts = room.render_batch(poses, ODD)

    for index in range(len(poses)):
        assert_same(parts[index], whole[index])


def test_depth_alone_is_the_same_depth(room: Renderer) -> None:
    poses = around(3)
    whole, depth_only = room.render_batch(poses, SMALL), room.render_batch(poses, SMALL, rgb=False)
    assert whole.depth_m.tobytes() == depth_only.depth_m.tobytes()
    assert whole.instance.tobytes() == depth_only.instance.tobytes()
    assert depth_only.rgb.shape == whole.rgb.shape
    assert not depth_only.rgb.any()


@pytest.mark.parametrize("rgb", [True, False])
def test_no_camera_takes_no_picture(room: Renderer, rgb: bool) -> None:
    batch = room.render_batch(np.zeros((0, 4, 4)), SMALL, rgb=rgb)
    assert len(batch) == 0
    assert batch.rgb.shape == (0, 32, 48, 3)
    assert batch.depth_m.shape == batch.instance.shape == (0, 32, 48)
    assert len(room.render_batch(np.zeros((0, 4, 4)), [], rgb=rgb)) == 0


def test_cameras_may_have_lenses_of_their_own(room: Renderer) -> None:
    poses = around(3)
    lenses = [SMALL, Intrinsics.from_horizontal_fov(48, 32, 40.0), replace(SMALL, cx=10.0)]

    batch = room.render_batch(poses, lenses)

    for index, (pose, lens) in enumerate(zip(poses, lenses, strict=True)):
        assert_same(batch[index], room.render(pose, lens))


def test_cameras_of_different_sizes_are_refused(room: Renderer) -> None:
    with pytest.raises(BenchbotError, match="15 x 9, 48 x 32"):
        room.render_batch(around(2), [SMALL, ODD])


def test_as_many_lenses_as_cameras_are_needed(room: Renderer) -> None:
    with pytest.raises(BenchbotError, match="2 camera poses but 3 intrinsics"):
        room.render_batch(around(2), [SMALL] * 3)


@pytest.mark.parametrize("shape", [(4, 4), (2, 3, 4), (0,)])
def test_what_is_no_list_of_poses_is_refused(room: Renderer, shape: tuple[int, ...]) -> None:
    with pytest.raises(BenchbotError, match="no camera poses"):
        room.render_batch(np.zeros(shape), SMALL)


def test_more_pictures_than_memory_can_be_addressed_are_refused(room: Renderer) -> None:
    with pytest.raises(BenchbotError, match="1000000 pictures of 48 x 32") as refused:
        room.render_batch(np.broadcast_to(np.eye(4), (1_000_000, 4, 4)), SMALL)
    assert refused.value.fix == "Take at most 508400 pictures at a time."


def test_frames_can_be_taken_into_the_memory_of_others(room: Renderer) -> None:
    poses = around(4)
    frames = room.render_on_device(poses[:2], SMALL)

    again = room.render_on_device(poses[2:], SMALL, out=frames)

    assert again is frames
    for index in range(2):
        assert_same(frames.to_host()[index], room.render(poses[2 + index], SMALL))


@pytest.mark.parametrize(
    ("count", "camera", "rgb"), [(3, SMALL, True), (2, ODD, True), (2, SMALL, False)], ids=["count", "size", "channels"]
)
def test_frames_of_another_shape_are_refused(room: Renderer, count: int, camera: Intrinsics, rgb: bool) -> None:
    frames = room.render_on_device(around(2), SMALL)
    with pytest.raises(BenchbotError, match="do not fit") as refused:
        room.render_on_device(around(count), camera, rgb=rgb, out=frames)
    assert "room for 2 pictures of 48 x 32 pixels with colour" in refused.value.why


def test_on_a_cpu_frames_are_arrays_that_others_can_share(room: Renderer) -> None:
    frames = room.render_on_device(around(2), ODD)
    batch = frames.to_host()
    for name in ("rgb", "depth_m", "instance"):
        shared = np.from_dlpack(getattr(frames, name))
        assert np.shares_memory(shared, getattr(frames, name))
        assert np.array_equal(shared, getattr(batch, name))


def test_a_device_array_says_where_its_values_lie(room: Renderer) -> None:
    """A CPU has Taichi's own arrays too: what holds for their addresses holds on a GPU."""
    owner = _ti.ti.ndarray(dtype=_ti.ti.i32, shape=6)
    owner.from_numpy(np.arange(6, dtype=np.int32))
    interface = DeviceArray(owner, (2, 2), (8, 4), "<i4", _ti.address(owner) + 8).__cuda_array_interface__
    address, read_only = interface["data"]
    assert list((ctypes.c_int32 * 4).from_address(address)) == [2, 3, 4, 5]
    assert not read_only
    assert (interface["version"], interface["shape"], interface["typestr"]) == (3, (2, 2), "<i4")
