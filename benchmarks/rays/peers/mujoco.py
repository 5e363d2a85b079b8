"""MuJoCo's rasteriser on the CPU (OSMesa): colour with a shadow, depth and segmentation are three passes."""

import os
from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.rays.peers.job import Job
from benchmarks.rays.workload import Workload

PEER = "MuJoCo OSMesa"
MODULE = "mujoco"
INSTALL = "pip install mujoco  (Debian also: apt install libosmesa6)"

os.environ["MUJOCO_GL"] = "osmesa"  # read when the module is imported


def jobs(work: Workload) -> list[Job]:
    """All three passes, and depth and segmentation alone."""
    mujoco: Any = import_module("mujoco")
    model = _model(mujoco, work)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    view = mujoco.Renderer(model, work.camera.height, work.camera.width)

    def one(kind: str) -> Any:
        view.disable_depth_rendering()
        view.disable_segmentation_rendering()
        if kind == "depth":
            view.enable_depth_rendering()
        if kind == "segmentation":
            view.enable_segmentation_rendering()
        view.update_scene(data, camera="eye")
        return view.render()

    def all_three() -> tuple[Any, Any, Any]:
        return one("rgb"), one("depth"), one("segmentation")

    def read(segmentation: Any) -> Any:
        return segmentation[..., 0].astype(np.int32) + 1  # geoms are added in the order of instances

    return [
        Job("frame", PEER, work.pixels, all_three, lambda answer: read(answer[2])),
        Job("frame", f"{PEER}, segmentation only", work.pixels, lambda: one("segmentation"), read),
    ]


def _model(mujoco: Any, work: Workload) -> Any:
    scene, camera = work.scene, work.camera
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth = camera.width
    spec.visual.global_.offheight = camera.height
    spec.visual.map.znear, spec.visual.map.zfar = 0.01, 10.0
    for instance in scene.instances:
        chosen = scene.triangles[scene.triangle_instance == instance.index]
        used, faces = np.unique(chosen, return_inverse=True)
        name = f"mesh{instance.index}"
        spec.add_mesh(
            name=name,
            uservert=scene.vertices[used].astype(np.float32).ravel(),
            userface=faces.astype(np.int32).ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        spec.worldbody.add_geom(
            name=f"geom{instance.index}",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=[*scene.materials[instance.index - 1].base_color, 1.0],
            contype=0,
            conaffinity=0,
        )
    turned = work.pose[:3, :3] * (1, -1, -1)
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, turned.ravel())
    tall = float(np.degrees(2 * np.arctan(camera.height / 2 / camera.fy)))
    spec.worldbody.add_camera(name="eye", pos=work.pose[:3, 3], quat=quaternion, fovy=tall)
    spec.worldbody.add_light(pos=work.lamp, dir=[0, 0, -1], castshadow=True, cutoff=80)
    return spec.compile()
