"""Distorted cameras: OpenCV's lens model, in every channel and every way of tracing."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.simulation.distortion import Distortion
from benchbot.plugins.simulation.sensors import Camera
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import quality
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

ray_traced = pytest.mark.xdist_group("renderer")
BARREL = Distortion(-0.12, 0.02, 0.004, -0.003, -0.001)
PINCUSHION = Distortion(0.15, -0.02, -0.002, 0.005)
PLAIN = Intrinsics(82, 58, 40.0, 42.0, 40.3, 29.4)
POSES = [looking((2.0, 1.0, 1.3), 30.0, -10.0), looking((1.0, 1.0, 1.0), 100.0, 20.0)]
STRENGTHS = st.floats(-0.02, 0.02)


def opencv_rays(camera: Intrinsics) -> np.ndarray:
    """(H, W, 3) rays of unit depth through the pixels' centres, as OpenCV finds them."""
    assert camera.distortion is not None
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    until = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-12)
    shown = np.stack([u, v], -1).reshape(-1, 1, 2)
    rays = cv2.undistortPoints(shown, matrix, camera.distortion.coefficients(), criteria=until)
    return np.dstack([rays.reshape(*u.shape, 2), np.ones_like(u)])


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> SceneGeometry:
    return load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))


@pytest.fixture(scope="module")
def room(scene: SceneGeometry, kernel_cache: Path) -> Renderer:
    return Renderer(scene, Lighting(), cache_dir=kernel_cache)


@pytest.mark.parametrize("distortion", [BARREL, PINCUSHION], ids=["barrel", "pincushion"])
def test_rays_and_points_are_those_of_opencv(distortion: Distortion) -> None:
    rays = opencv_rays(replace(PLAIN, distortion=distortion))
    u, v = np.meshgrid(np.arange(82) + 0.5, np.arange(58) + 0.5)
    shown_x, shown_y = (u - PLAIN.cx) / PLAIN.fx, (v - PLAIN.cy) / PLAIN.fy
    x, y = distortion.undistort(shown_x, shown_y)
    np.testing.assert_allclose(np.stack([x, y], -1), rays[..., :2], atol=1e-6)
    points, _ = cv2.projectPoints(
        rays.reshape(-1, 3), np.zeros(3), np.zeros(3), np.eye(3), np.array(distortion.coefficients())
    )
    np.testing.assert_allclose(points.reshape(rays.shape[0], -1, 2), np.stack(distortion.distort(x, y), -1), atol=1e-9)


@given(st.builds(Distortion, st.floats(-0.1, 0.2), STRENGTHS, STRENGTHS, STRENGTHS, STRENGTHS))
def test_what_passes_the_check_can_be_inverted(distortion: Distortion) -> None:
    try:
        distortion.check(-1.0, -0.6, 1.0, 0.6, 1 / 160)
    except ValueError:
        return
    shown = np.meshgrid(np.linspace(-1.0, 1.0, 21), np.linspace(-0.6, 0.6, 13))
    again = distortion.distort(*distortion.undistort(*shown))
    np.testing.assert_allclose(again, shown, atol=1e-4)


@ray_traced
@pytest.mark.parametrize("distortion", [BARREL, PINCUSHION], ids=["barrel", "pincushion"])
def test_depth_is_planar_along_opencvs_rays(room: Renderer, distortion: Distortion) -> None:
    camera = replace(PLAIN, distortion=distortion)
    rays = opencv_rays(camera).reshape(-1, 3)
    for pose in POSES:
        along = rays @ pose[:3, :3].T
        distances = room.cast(np.tile(pose[:3, 3], (len(along), 1)), along, 1e4) / np.linalg.norm(along, axis=1)
        depth = room.render(pose, camera, rgb=False).depth_m.ravel()
        both = np.isfinite(distances) & np.isfinite(depth)
        assert both.mean() > 0.9
        error = np.abs(np.where(both, depth, 0.0) - np.where(both, distances, 0.0))
        assert np.count_nonzero(error > 1e-4 * np.where(both, distances, 1.0)) <= 0.002 * len(error)  # edges


@ray_traced
@pytest.mark.parametrize("name", ["realtime", "fast"])
def test_all_channels_are_distorted_alike(scene: SceneGeometry, kernel_cache: Path, name: str) -> None:
    """Each pixel shows what an undistorted, finer picture shows where OpenCV says that its ray goes."""
    renderer = Renderer(scene, Lighting(), cache_dir=kernel_cache, quality=quality.QUALITIES[name])
    camera, fine = replace(PLAIN, distortion=BARREL), Intrinsics(600, 460, 200.0, 200.0, 300.0, 230.0)
    bent, straight = renderer.render(POSES[0], camera), renderer.render(POSES[0], fine)
    rays = opencv_rays(camera)
    column, row = (rays[..., 0] * 200 + 300).astype(int), (rays[..., 1] * 200 + 230).astype(int)
    assert min(column.min(), row.min()) >= 0
    assert column.max() < 600
    assert row.max() < 460
    assert np.mean(bent.instance == straight.instance[row, column]) > 0.98
    depth = np.abs(bent.depth_m - straight.depth_m[row, column]) / bent.depth_m
    assert np.mean(depth < 0.02) > 0.97
    colour = np.abs(bent.rgb.astype(int) - straight.rgb[row, column]).max(axis=-1)
    assert np.mean(colour < 30) > 0.9
    plain = renderer.render(POSES[0], PLAIN)
    assert np.mean(plain.instance == straight.instance[row, column]) < 0.96


@ray_traced
def test_a_batch_mixes_lenses(room: Renderer) -> None:
    cameras = [PLAIN, replace(PLAIN, distortion=BARREL), replace(PLAIN, distortion=Distortion())]
    batch = room.render_batch(np.stack([POSES[0]] * 3), cameras)
    for index, camera in enumerate(cameras):
        alone = room.render(POSES[0], camera)
        np.testing.assert_array_equal(batch[index].rgb, alone.rgb)
        np.testing.assert_array_equal(batch[index].depth_m, alone.depth_m)
    np.testing.assert_allclose(batch[2].depth_m, batch[0].depth_m, rtol=1e-5)


@pytest.mark.parametrize(
    "values",
    [{"k1": -0.5}, {"k1": 0.0, "k3": -0.4}, {"p1": 0.5}, {"k1": float("nan")}, {"k1": "strong"}, {"k4": 0.1}, [0.1], 3],
    ids=["folds", "folds at the corners", "tangential", "no number", "text", "unknown", "list", "number"],
)
def test_a_distortion_that_cannot_be_is_refused(values: object) -> None:
    camera = {"frame": "f", "width": 320, "height": 180, "fx": 160, "fy": 160, "cx": 160, "cy": 90, "range_m": [0, 9]}
    with pytest.raises((TypeError, ValueError), match="distortion"):
        Camera.from_mapping({**camera, "distortion": values})


def test_the_camera_reports_its_distortion() -> None:
    info = Camera("f", 320, 180, 160, 160, 160, 90, (0.1, 9.0), BARREL).info()
    assert info["distortion_model"] == "plumb_bob"
    assert info["distortion_coefficients"].tolist() == [-0.12, 0.02, 0.004, -0.003, -0.001]
    assert "distortion_model" not in Camera("f", 320, 180, 160, 160, 160, 90, (0.1, 9.0)).info()
