"""Depth, instances and ranges against Embree and against geometry that a pencil can solve."""

import os
from pathlib import Path

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene

from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")

MINIROOM = Path(__file__).parents[2] / "envs_bear/src/benchbot_envs_bear/scenes/miniroom_1.glb"
INTRINSICS = Intrinsics.from_horizontal_fov(320, 180, 90.0)


def embree(scene: SceneGeometry, pose: np.ndarray, camera: Intrinsics) -> tuple[np.ndarray, np.ndarray]:
    """Planar depth and instances as Embree sees them."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    rays = np.stack([(column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy, np.ones_like(row)], axis=-1)
    directions = np.ascontiguousarray(rays.reshape(-1, 3) @ pose[:3, :3].T, np.float32)
    origins = np.tile(pose[:3, 3].astype(np.float32), (len(directions), 1))
    device = EmbreeDevice()
    embree_scene = EmbreeScene(device, robust=True)
    TriangleMesh(embree_scene, scene.vertices, scene.triangles)
    hit = embree_scene.run(origins, directions, output=True, dists=np.full(len(origins), 1e30, np.float32))
    found = hit["primID"] >= 0
    depth = np.where(found, hit["tfar"], np.inf)
    instance = np.where(found, scene.triangle_instance[hit["primID"]], 0)
    return depth.reshape(row.shape), instance.reshape(row.shape)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> SceneGeometry:
    return load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))


@pytest.fixture(scope="module")
def renderer(room: SceneGeometry, kernel_cache: Path) -> Renderer:
    return Renderer(room, Lighting(), cache_dir=kernel_cache)


def assert_like_embree(scene: SceneGeometry, renderer: Renderer, poses: list[np.ndarray]) -> None:
    same, total = 0, 0
    for pose in poses:
        frame = renderer.render(pose, INTRINSICS, rgb=False)
        depth, instance = embree(scene, pose, INTRINSICS)
        equal = frame.instance == instance
        same, total = same + int(equal.sum()), total + equal.size
        both = equal & np.isfinite(depth)
        assert np.isfinite(frame.depth_m[both]).all()
        # A ray along an edge may meet either of two surfaces of one object; all others agree within a millimetre.
        close = np.abs(frame.depth_m[both] - depth[both]) < 1e-3
        assert close.mean() >= 0.9999
        assert np.array_equal(np.isinf(frame.depth_m), frame.instance == 0)
    assert same / total >= 0.9999


@pytest.mark.parametrize("yaw_deg", [0, 50, 120, 200, 290])
def test_depth_and_instances_equal_embrees(room: SceneGeometry, renderer: Renderer, yaw_deg: float) -> None:
    assert_like_embree(room, renderer, [looking((1.5, 0.9, 1.05), yaw_deg), looking((2.0, 1.5, 1.6), yaw_deg, -35)])


def test_depth_and_instances_equal_embrees_in_the_shipped_room(kernel_cache: Path) -> None:
    scene = load_scene(Path(os.environ.get("BENCHBOT_TEST_SCENE", MINIROOM)))
    renderer = Renderer(scene, Lighting(), cache_dir=kernel_cache)
    assert_like_embree(scene, renderer, [looking((1.2, 1.5, 1.05), yaw_deg) for yaw_deg in range(0, 360, 60)])


def test_depth_is_planar_and_a_full_picture_has_the_same(renderer: Renderer) -> None:
    pose = looking((2.0, 0.5, 1.2), 180)
    depth_only = renderer.render(pose, INTRINSICS, rgb=False)
    whole = renderer.render(pose, INTRINSICS)
    wall = depth_only.depth_m[60:90, 140:180]
    assert np.allclose(wall, 2.0, atol=1e-4)
    assert np.array_equal(depth_only.depth_m, whole.depth_m)
    assert np.array_equal(depth_only.instance, whole.instance)
    assert not depth_only.rgb.any()
    assert whole.rgb.any()


def test_a_laser_measures_the_walls(renderer: Renderer) -> None:
    angle = np.linspace(-np.pi, np.pi, 900, endpoint=False)
    origin = np.array([2.0, 0.5, 2.2])
    directions = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    with np.errstate(divide="ignore"):
        to_x = np.where(directions[:, 0] > 0, 4.0 - origin[0], origin[0]) / np.abs(directions[:, 0])
        to_y = np.where(directions[:, 1] > 0, 3.0 - origin[1], origin[1]) / np.abs(directions[:, 1])
    distances = renderer.cast(np.tile(origin, (900, 1)), directions, 10.0)
    assert distances.dtype == np.float32
    assert np.allclose(distances, np.minimum(to_x, to_y), atol=1e-3)


def test_a_laser_sees_nothing_beyond_its_range_and_scales_directions(renderer: Renderer) -> None:
    origins = np.array([[2.0, 0.5, 2.2], [2.0, 0.5, 2.2]])
    directions = np.array([[-5.0, 0.0, 0.0], [0.0, 9.0, 0.0]])
    assert renderer.cast(origins, directions, 2.2) == pytest.approx([2.0, np.inf], abs=1e-4)
    assert renderer.cast(np.zeros((0, 3)), np.zeros((0, 3)), 1.0).shape == (0,)


def test_glass_is_something_and_holes_are_nothing(tmp_path: Path, kernel_cache: Path) -> None:
    scene = load_scene(rooms.fence(tmp_path / "fence.glb"))
    renderer = Renderer(scene, Lighting(exposure=0.1), cache_dir=kernel_cache)
    frame = renderer.render(looking((0.0, 0.0, 1.0), 0.0), Intrinsics(90, 30, 30.0, 30.0, 45.0, 15.0))
    names = {instance.index: instance.name for instance in scene.instances}
    seen = [(names[frame.instance[15, u]], round(float(frame.depth_m[15, u]), 3)) for u in (20, 43, 50, 80)]
    assert seen == [("pane", 1.0), ("pane", 1.0), ("wall", 3.0), ("wall", 3.0)]
    beside_the_pane = renderer.render(looking((1.5, 0.5, 1.0), 0.0), Intrinsics(9, 3, 9.0, 9.0, 4.5, 1.5))
    assert names[beside_the_pane.instance[1, 4]] == "card"
    assert frame.rgb[15, 20].any()


@pytest.mark.parametrize("direction", [(np.nan, 0, 0), (0, 0, 0), (np.inf, 0, 0)])
def test_a_ray_that_is_no_ray_hits_nothing(renderer: Renderer, direction: tuple[float, float, float]) -> None:
    assert renderer.cast(np.array([[2.0, 0.5, 1.0]]), np.array([direction]), 10.0)[0] == np.inf


def test_a_camera_that_is_nowhere_sees_nothing(renderer: Renderer) -> None:
    frame = renderer.render(np.full((4, 4), np.nan), Intrinsics.from_horizontal_fov(16, 9, 90.0))
    assert np.isinf(frame.depth_m).all()
    assert not frame.instance.any()
