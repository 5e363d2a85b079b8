"""Pixels that a processor shades sixteen at once, beside the same shaded one by one, as on a GPU."""

import math
from pathlib import Path

import numpy as np
import pytest

from benchbot_scenes.gltf import load_scene
from benchbot_sim_taichi import edges
from benchbot_sim_taichi.frames import DeviceFrames
from benchbot_sim_taichi.intrinsics import camera_records
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests import rooms
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")

POSES = np.stack(
    [looking((0.4, 0.5, 1.5), 30.0, -15.0), looking((3.5, 0.6, 1.2), 120.0), looking((2.0, 8.0, 1.5), -90.0)]
)
CAMERA = Intrinsics.from_horizontal_fov(61, 43, 80.0)  # squares of 4 x 4 do not fill it


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> Renderer:
    scene = load_scene(rooms.furnished_room(tmp_path_factory.mktemp("room") / "room.glb"))
    return Renderer(scene, Lighting(), cache_dir=kernel_cache)


def test_sixteen_pixels_look_as_each_by_itself(room: Renderer) -> None:
    from benchbot_sim_taichi.kernels import paint

    together = room.render_batch(POSES, CAMERA)
    size = (len(POSES), CAMERA.width, CAMERA.height)
    pixels = math.prod(size)
    frames = DeviceFrames.allocate(*size, has_rgb=True)
    strides = {"guide": paint.GUIDE_STRIDE, "shades": paint.SHADE_STRIDE, "mirrors": paint.MIRROR_STRIDE}
    alone = {name: np.zeros(pixels * stride, np.float32) for name, stride in strides.items()}
    kinds, centers = np.zeros(pixels, np.int32), np.zeros(pixels * 3, np.float32)
    scene = (*room.device.tree, room.device.sheer_root, *room.device.surfaces)
    paint.paint(
        *scene,
        room.device.lights[0],
        *room.lightmap.arrays,
        camera_records(POSES, CAMERA, room.exposure).ravel(),
        *alone.values(),
        kinds,
        centers,
        frames.words,
        frames.depth_at(0),
        frames.instance_at(0),
        *size,
    )
    one_by_one = frames.to_host()
    assert np.array_equal(together.instance, one_by_one.instance)
    np.testing.assert_allclose(together.depth_m, one_by_one.depth_m, atol=1e-4)
    assert set(kinds & 3) == {paint.ROUGH, paint.GLOSSY, paint.MIRROR}
    for name in ("guide", "shades"):
        lanes = room._buffers[name][1][: pixels * strides[name]]
        differs = np.abs(lanes - alone[name]) > 1e-3 + 1e-2 * np.abs(alone[name])
        assert differs.mean() < 2e-3, name
    assert (room._buffers["kinds"][1][:pixels] != kinds).mean() < 2e-3


@pytest.mark.parametrize("edges_at_once", [edges.EDGES_AT_ONCE, 64], ids=["all edges together", "64 at a time"])
def test_edges_of_sixteen_points_look_as_each_pixel_by_itself(
    room: Renderer, monkeypatch: pytest.MonkeyPatch, edges_at_once: int
) -> None:
    from benchbot_sim_taichi.kernels import first_hits, paint, resolve

    monkeypatch.setattr(edges, "EDGES_AT_ONCE", edges_at_once)
    room.render_batch(POSES, CAMERA)
    size = (len(POSES), CAMERA.width, CAMERA.height)
    pixels = math.prod(size)
    strides = {"guide": paint.GUIDE_STRIDE, "shades": paint.SHADE_STRIDE, "mirrors": paint.MIRROR_STRIDE}
    seen = [room._buffers[name][1] for name in (*strides, "kinds", "centers")]
    alone = np.zeros(pixels * 3, np.float32)
    resolve.resolve_pixels(
        *room.device.tree,
        room.device.sheer_root,
        *room.device.surfaces,
        room.device.lights[0],
        *room.lightmap.arrays,
        camera_records(POSES, CAMERA, room.exposure).ravel(),
        *seen,
        alone,
        np.zeros(pixels + 1, np.int32),
        np.zeros(pixels * first_hits.SAMPLES * 3, np.float32),
        *size,
    )
    marks = room._buffers["marks"][1]
    found = marks[marks >= 0]
    assert 0.05 * pixels < len(np.unique(found)) == len(found) < 0.5 * pixels
    together = room._buffers["radiance"][1][: pixels * 3]
    differs = (np.abs(together - alone) > 1e-3 + 1e-2 * np.abs(alone)).reshape(-1, 3).any(1)
    assert not np.delete(differs, found).any()
    # One by one, samples look through one pane only.
    is_pane = (seen[1][3 : pixels * 4 : 4] < 0.0).reshape(size[0], CAMERA.height, CAMERA.width)
    around = [np.roll(is_pane, (down, across), (1, 2)) for down in (-1, 0, 1) for across in (-1, 0, 1)]
    clear = found[~np.any(around, axis=0).ravel()[found]]
    assert len(clear) > 0.3 * len(found)
    assert differs[clear].mean() < 2e-2
