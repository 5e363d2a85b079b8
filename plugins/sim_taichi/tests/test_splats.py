"""Pictures of Gaussian splats: against a plain reference, and beside the mesh that has depth and ids."""

import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from benchbot.core.declarations import schema
from benchbot.core.platform import PlatformSpec, Scene
from benchbot.simulation import Distortion, SrgbResponse
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.splats import Splats, transformed
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import FAST, PATH, QUALITIES, REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchbot_sim_taichi.simulator import RayTracedSimulator
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.glb import Glb
from plugins.sim_taichi.tests.splat_clouds import cloud, reference

pytestmark = pytest.mark.xdist_group("renderer")

LENS = Intrinsics.from_horizontal_fov(100, 75, 80.0)
BENT = replace(LENS, cx=55.0, fy=60.0, distortion=Distortion(-0.2, 0.05, 0.002, -0.001, 0.0))
DAY = Lighting(exposure=1.0)
POSE = looking((0.0, 0.3, 1.2), 5.0, -5.0)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> SceneGeometry:
    return load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))


def drawn(room: SceneGeometry, splats: Splats, cache: Path, quality: Quality = REALTIME) -> Renderer:
    return Renderer(replace(room, splats=splats), DAY, cache_dir=cache, quality=quality)


@pytest.mark.parametrize("lens", [LENS, BENT], ids=["pinhole", "distorted"])
@pytest.mark.parametrize("seed", [1, 2])
def test_pictures_are_those_of_every_gaussian_at_every_pixel(
    room: SceneGeometry, kernel_cache: Path, lens: Intrinsics, seed: int
) -> None:
    splats = cloud(300, seed)
    renderer = drawn(room, splats, kernel_cache)
    color, median = reference(splats, POSE, lens)
    off = np.abs(renderer.render(POSE, lens).rgb - 255.0 * color)
    # A weight close to the least that counts may fall to either side of it.
    assert np.quantile(off, 0.999) <= 0.51
    assert off.max() < 3.0
    depth = renderer.splats.depth_m(POSE, lens) if renderer.splats else np.zeros_like(median)
    assert np.mean(np.isclose(depth, median, rtol=1e-5)) > 0.998
    assert 0.2 < np.isfinite(median).mean() < 0.8


@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 10_000))
def test_a_place_that_is_turned_with_its_camera_looks_the_same(
    room: SceneGeometry, kernel_cache: Path, seed: int
) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    # Nothing is so near that doubling all lengths would let it be drawn.
    splats = cloud(200, seed, low=(1.5, -2.0, 0.0))
    moved = POSE.copy()
    moved[:3, :3], moved[:3, 3] = turn @ POSE[:3, :3], 2.0 * turn @ POSE[:3, 3] + [1.0, -2.0, 3.0]
    before = drawn(room, splats, kernel_cache).render(POSE, LENS).rgb.astype(int)
    turned = transformed(splats, turn, scale=2.0, offset=(1.0, -2.0, 3.0))
    after = drawn(room, turned, kernel_cache).render(moved, LENS).rgb.astype(int)
    off = np.abs(after - before)
    assert np.mean(off <= 1) > 0.999


def test_depth_and_ids_stay_those_of_the_mesh_and_no_quality_changes_a_byte(
    room: SceneGeometry, kernel_cache: Path
) -> None:
    splats = cloud(300, 3)
    pose = looking((1.5, 0.9, 1.05), 40.0)
    mesh = Renderer(room, DAY, cache_dir=kernel_cache).render(pose, LENS, rgb=False)
    frames = [drawn(room, splats, kernel_cache, quality).render(pose, LENS) for quality in QUALITIES.values()]
    for frame in frames:
        np.testing.assert_array_equal(frame.depth_m, mesh.depth_m)
        np.testing.assert_array_equal(frame.instance, mesh.instance)
        np.testing.assert_array_equal(frame.rgb, frames[0].rgb)
    assert frames[0].rgb.any()


def test_pictures_taken_together_are_those_taken_alone(room: SceneGeometry, kernel_cache: Path) -> None:
    renderer = drawn(room, cloud(300, 4), kernel_cache)
    poses = np.stack([looking((0.0, 0.3, 1.2), yaw) for yaw in (-20.0, 0.0, 30.0)])
    odd = Intrinsics.from_horizontal_fov(37, 21, 90.0)
    together = renderer.render_batch(poses, [odd, replace(odd, fx=30.0), odd])
    for index, lens in enumerate([odd, replace(odd, fx=30.0), odd]):
        alone = renderer.render(poses[index], lens)
        np.testing.assert_array_equal(together[index].rgb, alone.rgb)
        np.testing.assert_array_equal(together[index].depth_m, alone.depth_m)
    np.testing.assert_array_equal(renderer.render_batch(poses, odd).rgb[0], together[0].rgb)


def test_of_two_at_one_depth_the_first_is_in_front(room: SceneGeometry, kernel_cache: Path) -> None:
    two = Splats(
        positions_m=np.full((2, 3), (2.0, 0.0, 1.0), np.float32),
        rotations=np.tile(np.array([0, 0, 0, 1], np.float32), (2, 1)),
        scales_m=np.full((2, 3), 0.2, np.float32),
        opacities=np.full(2, 0.9, np.float32),
        colors=np.array([[1, 0, 0], [0, 1, 0]], np.float32),
        color_slopes=np.zeros((2, 3, 3), np.float32),
    )
    for splats, first in ((two, 0), (two.part(np.array([1, 0])), 1)):
        middle = drawn(room, splats, kernel_cache).render(looking((0.0, 0.0, 1.0), 0.0), LENS).rgb[37, 50]
        assert middle[first] > 200
        assert middle[1 - first] < 50


def test_where_no_splat_is_seen_the_picture_is_black(room: SceneGeometry, kernel_cache: Path) -> None:
    renderer = drawn(room, cloud(50, 5), kernel_cache)
    away = looking((0.0, 0.0, 1.0), 180.0)
    frame = renderer.render(away, LENS)
    assert not frame.rgb.any()
    assert renderer.splats is not None
    assert np.isinf(renderer.splats.depth_m(away, LENS)).all()


SAY_PICTURE = """
import hashlib, sys
from dataclasses import replace
from pathlib import Path
from benchbot_scenes.gltf import load_scene
from plugins.sim_taichi.tests import test_splats as tests
room = load_scene(tests.rooms.furnished_room(Path(sys.argv[1]) / "room.glb"))
renderer = tests.drawn(room, tests.cloud(3000, 6), Path(sys.argv[2]))
print(hashlib.sha256(renderer.render(tests.POSE, tests.BENT).rgb.tobytes()).hexdigest())
"""


def test_bytes_do_not_depend_on_the_number_of_threads(room: SceneGeometry, kernel_cache: Path, tmp_path: Path) -> None:
    ours = drawn(room, cloud(3000, 6), kernel_cache).render(POSE, BENT).rgb
    expected = hashlib.sha256(ours.tobytes()).hexdigest()
    for threads in ("1", "3"):
        told = subprocess.run(
            [sys.executable, "-c", SAY_PICTURE, str(tmp_path), str(kernel_cache)],
            env={**os.environ, "TI_CPU_MAX_NUM_THREADS": threads},
            capture_output=True,
            text=True,
            check=True,
        )
        assert told.stdout.split()[-1] == expected


def wall(x: float) -> Splats:
    """A blue wall of splats across the room."""
    y, z = (axis.ravel() for axis in np.meshgrid(np.arange(-1.0, 4.0, 0.04), np.arange(-1.0, 3.5, 0.04)))
    count = len(y)
    return Splats(
        positions_m=np.stack([np.full(count, x), y, z], axis=1).astype(np.float32),
        rotations=np.tile(np.array([0, 0, 0, 1], np.float32), (count, 1)),
        scales_m=np.tile(np.array([0.005, 0.04, 0.04], np.float32), (count, 1)),
        opacities=np.full(count, 0.95, np.float32),
        colors=np.tile(np.array([0, 0, 1], np.float32), (count, 1)),
        color_slopes=np.zeros((count, 3, 3), np.float32),
    )


def is_blue(rgb: np.ndarray) -> np.ndarray:
    return np.asarray((rgb[..., 2] > 230) & (rgb[..., :2].max(axis=-1) < 20))


@pytest.mark.parametrize("quality", [FAST, PATH], ids=["fast", "path"])
def test_objects_that_come_or_move_are_seen_before_the_splats(
    room: SceneGeometry, kernel_cache: Path, tmp_path: Path, quality: Quality
) -> None:
    renderer = drawn(room, wall(2.5), kernel_cache, quality)
    pose = looking((0.6, 1.5, 1.2), 0.0)
    assert is_blue(renderer.render(pose, LENS).rgb).all()
    glb = Glb()
    glb.box("crate", (-0.2, -0.2, -0.2), (0.2, 0.2, 0.2), glb.material((0.8, 0.1, 0.1)))
    crate = load_scene(glb.write(tmp_path / "crate.glb"))
    at = np.eye(4)
    at[:3, 3] = (1.6, 1.5, 1.2)
    (number,) = renderer.add(crate, at)
    frame = renderer.render(pose, LENS)
    is_crate = frame.instance == number
    assert is_crate.sum() > 500
    np.testing.assert_array_equal(is_blue(frame.rgb), ~is_crate)
    at[0, 3] = 3.4  # behind the splats
    renderer.move(number, at)
    assert is_blue(renderer.render(pose, LENS).rgb).all()
    chest = next(found.index for found in room.instances if found.name == "chest")
    closer = np.eye(4)
    closer[:3, 3] = (1.2, 0.0, 0.5)
    renderer.move(chest, closer)
    frame = renderer.render(pose, LENS)
    np.testing.assert_array_equal(is_blue(frame.rgb), frame.instance != chest)
    renderer.remove(chest)
    assert is_blue(renderer.render(pose, LENS).rgb).all()


def test_a_simulator_shows_splats_with_the_noise_of_its_camera(
    room: SceneGeometry, kernel_cache: Path, tmp_path: Path
) -> None:
    (tmp_path / "room.glb").write_bytes(to_glb(replace(room, splats=wall(2.5))))
    place = {"name": "room", "variant": 1, "type": "sim_taichi", "map_path": "room.glb", "object_labels": ["table"]}
    scene = Scene(place | {"start_pose": [1, 0, 0, 0, 0.8, 1.5, 0]}, tmp_path)
    robots = Path(str(files("benchbot_sim_taichi"))) / "robots"
    seen = {}
    for name in ("carter_lowres", "carter_realistic"):
        platform = RayTracedSimulator(PlatformSpec(schema.read(robots / f"{name}.yaml"), "ground_truth", kernel_cache))
        platform.load(scene, seed=0)
        assert isinstance(platform.response, SrgbResponse)
        seen[name] = platform.observe(["image_rgb", "image_depth"])
    plain, noisy = (observed["image_rgb"] for observed in seen.values())
    assert is_blue(plain).all()
    assert noisy[..., 2].std() > 0.0 or noisy[..., 0].std() > 0.0
    np.testing.assert_allclose(noisy.reshape(-1, 3).mean(axis=0), plain.reshape(-1, 3).mean(axis=0), atol=6.0)
    assert (
        np.nanmax(np.where(np.isfinite(seen["carter_lowres"]["image_depth"]), seen["carter_lowres"]["image_depth"], 0))
        > 2.5
    )
