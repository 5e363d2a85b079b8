"""Camera rays that are traced many at once see what each sees by itself."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import renderer as rendering
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")

CAMERA = Intrinsics.from_horizontal_fov(62, 37, 90.0)
BESIDE_SURFACES = st.integers(-20, 90).map(lambda step: 0.0513 * step + 0.0007)


@pytest.fixture(scope="module", autouse=True)
def always_many_at_once() -> Iterator[None]:
    """However small the picture is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rendering, "TRIANGLES_PER_PIXEL", 10**6)
        yield


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> Renderer:
    scene = load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))
    return Renderer(scene, Lighting(), cache_dir=kernel_cache)


def one_by_one(renderer: Renderer, pose: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """Depth (H, W) from a ray of its own for each pixel."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    image = np.stack([(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, np.ones_like(row)], axis=-1)
    rays = image.reshape(-1, 3) @ pose[:3, :3].T
    distances = renderer.cast(np.tile(pose[:3, 3], (len(rays), 1)), rays, 1e4)
    depth: np.ndarray = distances / np.linalg.norm(rays, axis=1)
    return depth.reshape(row.shape)


def assert_same(renderer: Renderer, pose: np.ndarray, camera: Intrinsics) -> None:
    depth = renderer.render(pose, camera, rgb=False).depth_m
    alone = one_by_one(renderer, pose, camera)
    hit = np.isfinite(alone)
    # Where a ray meets an edge, rounding decides between the two surfaces (and whether it passes between them).
    differs = np.isfinite(depth) != hit
    differs[hit] |= np.abs(np.where(np.isfinite(depth), depth, 0.0)[hit] - alone[hit]) > 1e-3
    assert differs.sum() <= max(1, round(0.001 * depth.size))


@settings(max_examples=40, deadline=None)
@given(
    place=st.tuples(BESIDE_SURFACES, BESIDE_SURFACES, BESIDE_SURFACES),
    yaw_deg=st.floats(-180, 180),
    pitch_deg=st.floats(-90, 90),
)
def test_from_anywhere_in_any_direction(
    room: Renderer, place: tuple[float, float, float], yaw_deg: float, pitch_deg: float
) -> None:
    assert_same(room, looking(place, yaw_deg, pitch_deg), CAMERA)


@pytest.mark.parametrize("yaw_deg", [0, 90, 180, 270])
def test_along_the_axes(room: Renderer, yaw_deg: float) -> None:
    assert_same(room, looking((1.5, 0.9, 1.05), yaw_deg), CAMERA)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 9), (3, 2), (5, 4), (17, 6), (4, 4)])
def test_in_pictures_that_are_no_whole_number_of_squares(room: Renderer, width: int, height: int) -> None:
    assert_same(room, looking((1.5, 0.9, 1.05), 40.0), Intrinsics.from_horizontal_fov(width, height, 80.0))


@pytest.mark.parametrize(
    "camera",
    [
        Intrinsics(40, 30, 20.0, 20.0, -35.0, 90.0),
        Intrinsics(40, 30, 2.0, 3.0, 20.0, 15.0),
        Intrinsics(40, 30, 9000.0, 9000.0, 20.0, 15.0),
        Intrinsics(40, 30, -30.0, 30.0, 20.0, 15.0),
    ],
    ids=["axis beside the picture", "very wide", "very narrow", "mirrored"],
)
def test_through_unusual_lenses(room: Renderer, camera: Intrinsics) -> None:
    assert_same(room, looking((1.5, 0.9, 1.05), 70.0, -20.0), camera)


@pytest.mark.parametrize("stretch", [np.diag([2.0, 1.0, 1.0]), np.array([[1, 0.4, 0], [0, 1, 0], [0.2, 0, 0.7]])])
def test_through_a_pose_that_is_no_rotation(room: Renderer, stretch: np.ndarray) -> None:
    pose = looking((1.5, 0.9, 1.05), 40.0, -10.0)
    pose[:3, :3] = pose[:3, :3] @ stretch
    assert_same(room, pose, CAMERA)


def test_behind_cards_with_holes(tmp_path: Path, kernel_cache: Path) -> None:
    """What a hole shows is found by rays that go on from there."""
    renderer = Renderer(load_scene(rooms.fence(tmp_path / "fence.glb")), Lighting(exposure=0.1), cache_dir=kernel_cache)
    frame = renderer.render(looking((0.0, 0.0, 1.0), 0.0), Intrinsics(90, 30, 30.0, 30.0, 45.0, 15.0), rgb=False)
    assert frame.depth_m[15, [20, 80]] == pytest.approx([1.0, 3.0], abs=1e-4)


def test_a_scene_too_fine_for_its_picture_is_seen_ray_by_ray(room: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    pose = looking((1.5, 0.9, 1.05), 200.0)
    together = room.render(pose, CAMERA)
    monkeypatch.setattr(rendering, "TRIANGLES_PER_PIXEL", 0)
    alone = room.render(pose, CAMERA)
    assert (together.instance != alone.instance).mean() <= 0.001
    assert (np.abs(together.rgb.astype(int) - alone.rgb) > 1).mean() < 0.01
