"""PyBullet's TinyRenderer: a rasteriser on one thread; colour, depth and bodies in one pass."""

import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rays.peers.job import Job
from benchmarks.rays.workload import Workload

PEER = "PyBullet TinyRenderer"
MODULE = "pybullet"
INSTALL = "pip install pybullet"
NEAR_M, FAR_M = 0.05, 20.0


def jobs(work: Workload) -> list[Job]:
    """A picture with a shadow and one without."""
    bullet: Any = import_module("pybullet")
    client = bullet.connect(bullet.DIRECT)
    scene, camera = work.scene, work.camera
    instance_of = np.zeros(len(scene.instances), np.int32)
    with tempfile.TemporaryDirectory() as folder:
        for instance in scene.instances:
            chosen = scene.triangles[scene.triangle_instance == instance.index]
            used, faces = np.unique(chosen, return_inverse=True)
            path = Path(folder) / f"{instance.index}.obj"
            lines = [f"v {x:.7g} {y:.7g} {z:.7g}" for x, y, z in scene.vertices[used]]
            lines += [f"f {a} {b} {c}" for a, b, c in faces.reshape(-1, 3) + 1]
            path.write_text("\n".join(lines) + "\n", encoding="ascii")
            color = [*scene.materials[instance.index - 1].base_color, 1.0]
            shape = bullet.createVisualShape(
                bullet.GEOM_MESH, fileName=str(path), rgbaColor=color, physicsClientId=client
            )
            body = bullet.createMultiBody(baseVisualShapeIndex=shape, physicsClientId=client)
            instance_of[body] = instance.index
    eye, forward, down = work.pose[:3, 3], work.pose[:3, 2], work.pose[:3, 1]
    view = bullet.computeViewMatrix(eye.tolist(), (eye + forward).tolist(), (-down).tolist())
    tall = float(np.degrees(2 * np.arctan(camera.height / 2 / camera.fy)))
    lens = bullet.computeProjectionMatrixFOV(tall, camera.width / camera.height, NEAR_M, FAR_M)

    def take(shadow: int) -> Any:
        return bullet.getCameraImage(
            camera.width,
            camera.height,
            view,
            lens,
            shadow=shadow,
            lightDirection=[0.3, 0.2, 1.0],
            renderer=bullet.ER_TINY_RENDERER,
            physicsClientId=client,
        )

    def read(answer: Any) -> Any:
        body = np.asarray(answer[4]).reshape(camera.height, camera.width)
        return np.where(body >= 0, instance_of[np.maximum(body, 0)], 0)

    return [
        Job("frame", PEER, work.pixels, lambda: take(1), read),
        Job("frame", f"{PEER}, no shadow", work.pixels, lambda: take(0), read),
    ]
