"""Open3D's RaycastingScene: Embree on all cores."""

from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.rays.peers.job import Job, found
from benchmarks.rays.workload import Rays, Workload

PEER = "Open3D (Embree)"
MODULE = "open3d"
INSTALL = "pip install open3d  (Debian also: apt install libusb-1.0-0)"


def jobs(work: Workload, threads: int = 0) -> list[Job]:
    """Primary, shadow and bounce rays on `threads` threads (0: all)."""
    open3d: Any = import_module("open3d")
    target = open3d.t.geometry.RaycastingScene()
    target.add_triangles(
        open3d.core.Tensor(work.scene.vertices), open3d.core.Tensor(work.scene.triangles.astype(np.uint32))
    )

    def tensor(rays: Rays) -> Any:
        return open3d.core.Tensor(np.concatenate([rays.origins, rays.directions], axis=1))

    def cast(measure: str, rays: Rays) -> Job:
        ready = tensor(rays)
        return Job(
            measure,
            PEER,
            len(rays.origins),
            lambda: target.cast_rays(ready, nthreads=threads),
            lambda answer: found(answer["t_hit"].numpy()),
        )

    shadow = tensor(work.shadow)
    return [
        cast("primary", work.primary),
        Job(
            "shadow",
            PEER,
            len(work.shadow.origins),
            lambda: target.test_occlusions(shadow, tnear=0.0, tfar=1.0, nthreads=threads),
            lambda answer: answer.numpy(),
        ),
        cast("bounce", work.bounce),
    ]
