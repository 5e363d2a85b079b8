"""Pictures and rays are those of the scene's triangles, as Embree has them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot.simulation import Camera, Distortion
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_mujoco import opengl
from benchbot_sim_mujoco.drawing import Drawing
from benchbot_sim_taichi.renderer import Intrinsics
from plugins.sim_taichi.tests.embree import Embree
from plugins.sim_taichi.tests.rooms import furnished_room

CAMERA = Camera("eye", 160, 120, 90.0, 95.0, 70.0, 64.5, (0.05, 20.0))
LENS = Distortion(-0.08, 0.01, 0.001, -0.002)
POSES = [Pose.from_xyz_rpy_deg((0.9, 0.6, 1.3), rpy_deg) for rpy_deg in ((-100, 0, -50), (-75, 0, -20))]


@pytest.fixture(scope="module")
def geometry(tmp_path_factory: pytest.TempPathFactory) -> SceneGeometry:
    return load_scene(furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))


@pytest.fixture(scope="module")
def drawing(geometry: SceneGeometry) -> Drawing:
    return Drawing(geometry, ())


@pytest.mark.parametrize("lens", [None, LENS], ids=["pinhole", "distorted"])
def test_depth_is_that_of_embree(geometry: SceneGeometry, drawing: Drawing, lens: Distortion | None) -> None:
    camera = replace(CAMERA, distortion=lens)
    rays = np.stack([camera.view.x, camera.view.y, np.ones_like(camera.view.x)], -1).reshape(-1, 3)
    for pose, frame in zip(POSES, drawing.render(camera, POSES, rgb=False), strict=True):
        along = rays @ pose.matrix()[:3, :3].T
        expected_m = Embree(geometry).cast(pose.translation_xyz, along) / np.linalg.norm(rays, axis=1)
        error_m = np.abs(frame.depth_m.ravel() - expected_m)
        # Where a lens distorts, edges are those of the nearest pixel.
        assert np.median(error_m) < 1e-4
        assert np.mean(error_m < 2e-3) > (0.998 if lens is None else 0.94)


def test_instances_are_those_of_embree(geometry: SceneGeometry, drawing: Drawing) -> None:
    camera = Intrinsics(CAMERA.width, CAMERA.height, CAMERA.fx, CAMERA.fy, CAMERA.cx + 0.5, CAMERA.cy + 0.5)
    for pose, frame in zip(POSES, drawing.render(CAMERA, POSES, rgb=False), strict=True):
        expected = Embree(geometry).see(pose.matrix(), camera)[1]
        assert len(np.unique(expected)) > 4
        assert np.mean(frame.instance == expected) > 0.998


def test_rays_are_those_of_embree(geometry: SceneGeometry, drawing: Drawing) -> None:
    rng = np.random.default_rng(0)
    along = rng.standard_normal((600, 3))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    origins = np.repeat([[1.0, 0.6, 1.2], [3.0, 0.5, 0.3]], 300, axis=0)
    embree = Embree(geometry)
    expected = np.concatenate([embree.cast(tuple(origins[i]), along[i : i + 300]) for i in (0, 300)])
    found = drawing.cast(origins, along, 20.0)
    assert np.mean(np.abs(found - expected) < 1e-4) > 0.998
    assert (drawing.cast(origins, along, 1.0)[expected > 1.01] == np.inf).all()


def test_a_picture_is_drawn_only_where_it_is_asked_for(drawing: Drawing) -> None:
    (colored,), (plain,) = (drawing.render(CAMERA, POSES[:1], rgb=rgb) for rgb in (True, False))
    assert colored.rgb.std() > 10
    assert not plain.rgb.any()
    assert colored.depth_m.tobytes() == plain.depth_m.tobytes()
    assert drawing.render(CAMERA, POSES[:1], rgb=True)[0].rgb.tobytes() == colored.rgb.tobytes()


def test_doctor_says_by_what_pictures_are_drawn(tmp_path: Path) -> None:
    assert "MuJoCo" in opengl.try_out(tmp_path)
    assert "OpenGL" in opengl.described({"device": "cpu"})
    with pytest.raises(BenchbotError, match="does not simulate on 'cuda'"):
        opengl.described({"device": "cuda"})


def test_without_opengl_there_are_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(opengl, "LIBRARIES", {"egl": "libnone.so.1", "osmesa": "libnone.so.2"})
    assert opengl.described({}) == "cpu, without pictures"
    with pytest.raises(BenchbotError, match="cannot draw pictures") as caught:
        opengl.context()
    assert "libegl1" in caught.value.fix
