"""BenchBot's own ray tracer."""

import numpy as np

from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.renderer import Renderer
from benchmarks.rays import kernels
from benchmarks.rays.peers.job import Job, found
from benchmarks.rays.workload import FAR_M, Workload

PEER = "ours"
PATH_SAMPLES = 4
NO_LIMIT = NOTHING = 1e30
PATH_REFLECTIONS = 3  # as many as the depth of 4 of peers, who count the camera's edge


def jobs(work: Workload, renderer: Renderer) -> list[Job]:
    """Everything that peers are asked."""
    camera, pose, bounce, shadow = work.camera, work.pose, work.bounce, work.shadow
    return [
        Job(
            "primary",
            PEER,
            work.pixels,
            lambda: kernels.first_hits_of(renderer, pose, camera),
            lambda hits: kernels.distances_of(hits, camera) < NOTHING,
        ),
        Job(
            "primary",
            f"{PEER}, depth and instances",
            work.pixels,
            lambda: renderer.render(pose, camera, rgb=False),
            lambda frame: found(frame.depth_m).ravel(),
        ),
        Job(
            "shadow",
            PEER,
            len(shadow.origins),
            lambda: kernels.occluded(renderer, shadow.origins, shadow.directions, 1.0),
            lambda blocked: blocked > 0,
        ),
        Job(
            "bounce",
            PEER,
            len(bounce.origins),
            lambda: kernels.nearest(renderer, bounce.origins, bounce.directions, FAR_M),
            lambda hit: hit[1] >= 0,
        ),
        Job(
            "frame",
            PEER,
            work.pixels,
            lambda: kernels.frame(renderer, pose, camera, work.lamp),
            lambda frame: frame[2],
        ),
        Job(
            "frame",
            f"{PEER}, realtime",
            work.pixels,
            lambda: renderer.render(pose, camera),
            lambda frame: frame.instance,
        ),
        Job(
            "path",
            PEER,
            work.small.width * work.small.height * PATH_SAMPLES,
            lambda: path_trace(
                renderer, pose, work.small, samples_per_pixel=PATH_SAMPLES, bounces=PATH_REFLECTIONS, brightest=NO_LIMIT
            ),
            lambda radiance: np.asarray((radiance / renderer.exposure).mean(axis=(0, 1))),
        ),
    ]
