"""Embree through embreex: one thread."""

from importlib import import_module
from typing import Any

import numpy as np

from benchmarks.rays.peers.job import Job
from benchmarks.rays.workload import Rays, Workload

PEER = "embreex (1 thread)"
MODULE = "embreex"
INSTALL = "pip install embreex"


def jobs(work: Workload) -> list[Job]:
    """Primary, shadow and bounce rays."""
    construction: Any = import_module("embreex.mesh_construction")
    core: Any = import_module("embreex.rtcore")
    scenes: Any = import_module("embreex.rtcore_scene")
    device = core.EmbreeDevice()
    target = scenes.EmbreeScene(device)
    construction.TriangleMesh(target, work.scene.vertices, work.scene.triangles)

    def job(measure: str, rays: Rays, reach: float, query: str) -> Job:
        def run() -> Any:
            reaches = np.full(len(rays.origins), reach, np.float32)
            return target.run(rays.origins, rays.directions, dists=reaches, query=query, output=query == "INTERSECT")

        def read(answer: Any) -> Any:
            return answer["primID"] >= 0 if query == "INTERSECT" else np.asarray(answer) >= 0

        return Job(measure, PEER, len(rays.origins), run, read)

    return [
        job("primary", work.primary, 1e30, "INTERSECT"),
        job("shadow", work.shadow, 1.0, "OCCLUDED"),
        job("bounce", work.bounce, 1e30, "INTERSECT"),
    ]
