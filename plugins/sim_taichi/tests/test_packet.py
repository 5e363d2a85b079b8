"""Camera rays that are traced many at once see what each sees by itself."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")

REACH = 1e4
CAMERA = Intrinsics.from_horizontal_fov(62, 37, 90.0)
BESIDE_SURFACES = st.integers(-20, 90).map(lambda step: 0.0513 * step + 0.0007)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> Renderer:
    scene = load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))
    return Renderer(scene, Lighting(), cache_dir=kernel_cache)


def cast_one_by_one(renderer: Renderer, origins: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Distances (N,) in units of the rays' lengths, from a ray by itself for each; FAR where nothing is."""
    from benchbot_sim_taichi.kernels import primary

    distances = np.empty(len(rays), np.float32)
    arrays = (origins.astype(np.float32).ravel(), rays.astype(np.float32).ravel())
    primary.cast_rays(*renderer.device.tree, renderer.device.sheer_root, *arrays, REACH, distances, len(rays))
    return distances


def one_by_one(renderer: Renderer, pose: np.ndarray, camera: Intrinsics) -> np.ndarray:
    """Depth (H, W) from a ray of its own for each pixel."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    image = np.stack([(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, np.ones_like(row)], axis=-1)
    rays = image.reshape(-1, 3) @ pose[:3, :3].T
    depth = cast_one_by_one(renderer, np.tile(pose[:3, 3], (len(rays), 1)), rays)
    return np.where(depth < REACH, depth, np.inf).reshape(row.shape)


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


@settings(max_examples=40, deadline=None)
@given(
    place=st.tuples(BESIDE_SURFACES, BESIDE_SURFACES, BESIDE_SURFACES),
    spread=st.floats(0, 4),
    count=st.integers(1, 70),
    seed=st.integers(0, 2**31),
)
def test_rays_of_all_directions(
    room: Renderer, place: tuple[float, float, float], spread: float, count: int, seed: int
) -> None:
    """From any places to any places: side by side, crossing each other, or with nothing in common."""
    random = np.random.default_rng(seed)
    origins = place + spread * random.uniform(-0.5, 0.5, (count, 3))
    rays = random.normal(size=3) + spread * random.normal(size=(count, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    together, alone = room.cast(origins, rays, REACH), cast_one_by_one(room, origins, rays)
    alone[alone >= REACH] = np.inf
    same = np.isclose(together, alone, rtol=1e-5, atol=1e-4)
    assert np.count_nonzero(~same) <= 1 + count // 50


def test_a_ray_that_is_none_leaves_its_neighbours_alone(room: Renderer) -> None:
    origins = np.full((16, 3), 1.05)
    rays = np.tile([1.0, 0.02, 0.01], (16, 1))
    expected = room.cast(origins, rays, REACH)
    assert np.isfinite(expected).all()
    origins[3], rays[5], rays[9] = np.nan, 0.0, [np.inf, 0.0, 0.0]
    found = room.cast(origins, rays, REACH)
    is_none = np.isin(np.arange(16), [3, 5, 9])
    assert np.isinf(found[is_none]).all()
    assert np.array_equal(found[~is_none], expected[~is_none])


@settings(max_examples=30, deadline=None)
@given(spread=st.floats(0, 2), seed=st.integers(0, 2**31))
def test_what_is_in_the_way_of_sixteen_rays(room: Renderer, spread: float, seed: int) -> None:
    from plugins.sim_taichi.tests.blocked_rays import find_blocked

    random = np.random.default_rng(seed)
    origins = np.array([1.5, 0.9, 1.05]) + spread * random.uniform(-0.5, 0.5, (45, 3))
    ends = np.array([0.4, 0.3, 0.6]) + spread * random.uniform(-0.5, 0.5, (45, 3))
    together, alone = np.empty(45, np.int32), np.empty(45, np.int32)
    arrays = (origins.astype(np.float32).ravel(), (ends - origins).astype(np.float32).ravel())
    find_blocked(*room.device.tree, *arrays, together, alone, 45)
    assert np.count_nonzero(together != alone) <= 1
