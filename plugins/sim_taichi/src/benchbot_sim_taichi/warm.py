"""Compiling everything ahead, so that the first run starts fast."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchbot.plugin import Pose
from benchbot_scenes.scene import Material, SceneGeometry, Splats
from benchbot_sim_taichi import progress
from benchbot_sim_taichi.devices import resolve
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import FAST, PATH, REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer

QUALITIES = (REALTIME, FAST, Quality(PATH.name, 1))
"""One of each way to take a picture: `reference` is taken as `path` is."""


def warm(cache_dir: Path) -> str:
    """Compile all kernels into `cache_dir`, for the device that runs choose by themselves; return what was done."""
    started_s = time.monotonic()
    device = resolve({})
    view = Pose((0.0, 0.0, 1.0), (-0.5, 0.5, -0.5, 0.5)).matrix()
    intrinsics = Intrinsics(16, 16, 8.0, 8.0, 8.0, 8.0)
    for quality in QUALITIES:
        progress.tell(f"the simulator compiles what takes pictures of the quality {quality.name}")
        for scene in (_corner(triangles=6), _corner(triangles=8)):
            renderer = Renderer(scene, Lighting(), cache_dir=cache_dir, device=device.kind, quality=quality)
            renderer.render(view, intrinsics)
            renderer.render(view, intrinsics, rgb=False)
    scanned = replace(_corner(triangles=6), splats=_splat())
    Renderer(scanned, Lighting(), cache_dir=cache_dir, device=device.kind).render(view, intrinsics)
    renderer.cast(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), 10.0)
    return f"compiled the ray tracer for {device} in {time.monotonic() - started_s:.1f} s into {cache_dir}"


def _splat() -> Splats:
    ones = np.ones((1, 3), np.float32)
    return Splats(ones, np.full((1, 4), 0.5, np.float32), ones, ones[:, 0], ones, np.zeros((1, 3, 3), np.float32))


def _corner(triangles: int) -> SceneGeometry:
    """Return a floor, a glowing wall and, with all 8 triangles, a window: too many for one leaf of the search tree."""
    vertices = [(-1, -3, 0), (3, -3, 0), (3, 3, 0), (-1, 3, 0), (3, -3, 3), (3, 3, 3), (-1, -3, 3)]
    corners = [(0, 1, 2), (0, 2, 3), (2, 1, 4), (2, 4, 5), (4, 6, 3), (4, 3, 5), (1, 0, 6), (1, 6, 4)]
    normals = [(0.0, 0.0, 1.0)] * 4 + [(-1.0, 0.0, 0.0)] * 3
    materials = (Material("floor"), Material("wall", emission=(1.0, 1.0, 1.0)), Material("window", transmission=1.0))
    return SceneGeometry(
        vertices=np.array(vertices, np.float32),
        triangles=np.array(corners[:triangles], np.int32),
        triangle_instance=np.zeros(triangles, np.int32),
        triangle_material=np.array([0, 0, 1, 1, 0, 0, 2, 2][:triangles], np.int32),
        normals=np.array(normals, np.float32),
        uvs=np.zeros((len(vertices), 2), np.float32),
        materials=materials,
        instances=(),
    )
