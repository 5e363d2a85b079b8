"""Mitsuba 3 on the CPU (variant llvm_ad_rgb), all cores."""

import os
import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.rays import mitsuba_scene
from benchmarks.rays.peers.job import Job, found
from benchmarks.rays.workload import Rays, Workload

PEER = "Mitsuba (llvm)"
MODULE = "mitsuba"
INSTALL = "pip install mitsuba  (Debian also: apt install libllvm19)"
PATH_SAMPLES = 4
PATH_DEPTH = 4
LLVM = sorted(Path("/usr/lib").glob("*/libLLVM.so.19*"))  # the one that it picks by itself may be too old

if LLVM:
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", str(LLVM[0]))


def jobs(work: Workload) -> list[Job]:
    """Rays ready-made in its own arrays; a picture in one kernel; path tracing by its own integrator."""
    mi: Any = import_module("mitsuba")
    mi.set_variant("llvm_ad_rgb")
    dr: Any = import_module("drjit")
    with tempfile.TemporaryDirectory() as folder:
        scene, tables = mitsuba_scene.load(work.scene, Path(folder))
        ours_alike, _ = mitsuba_scene.load(work.scene, Path(folder), look=mitsuba_scene.gltf)
    rays = {name: _rays(mi, getattr(work, name)) for name in ("primary", "shadow", "bounce")}
    dr.eval(*rays.values())
    shadow = mi.Ray3f(rays["shadow"])
    shadow.maxt = mi.Float(1.0)

    def preliminary(name: str) -> Any:
        hit = scene.ray_intersect_preliminary(rays[name], coherent=name == "primary")
        return _done(dr, hit.t, hit.prim_index, hit.shape)[0]

    def full(name: str) -> Any:
        hit = scene.ray_intersect(rays[name], ray_flags=mi.RayFlags.All, coherent=name == "primary")
        return _done(dr, hit.t, hit.prim_index, hit.shape, hit.n, hit.uv, hit.p)[0]

    def path(painted: Any) -> Any:
        seeds[0] += 1
        picture = mi.render(painted, sensor=sensor, integrator=integrator, spp=PATH_SAMPLES, seed=seeds[0])
        return _done(dr, picture)[0]

    integrator = mi.load_dict({"type": "path", "max_depth": PATH_DEPTH, "rr_depth": 100})
    sensor = mitsuba_scene.sensor(work.pose, work.small)
    seeds = [0]
    listed = []
    for name in ("primary", "bounce"):
        count = len(getattr(work, name).origins)
        for label, run in (("", full), (", preliminary", preliminary)):
            listed.append(Job(name, PEER + label, count, lambda run=run, name=name: run(name), _found))  # type: ignore[misc]
    return [
        *listed,
        Job("shadow", PEER, len(work.shadow.origins), lambda: _done(dr, scene.ray_test(shadow))[0], np.array),
        Job(
            "frame",
            PEER,
            work.pixels,
            _picture(mi, dr, scene, tables, work),
            lambda frame: frame[2].reshape(work.camera.height, work.camera.width),
        ),
        *(
            Job(
                "path",
                PEER + label,
                work.small.width * work.small.height * PATH_SAMPLES,
                lambda painted=painted: path(painted),  # type: ignore[misc]
                lambda picture: np.array(picture).mean(axis=(0, 1)),
            )
            for label, painted in (("", ours_alike), (", matt surfaces", scene))
        ),
    ]


def _found(distance: Any) -> Any:
    return found(np.array(distance))


def _rays(mi: Any, rays: Rays) -> Any:
    return mi.Ray3f(mi.Point3f(rays.origins.T.copy()), mi.Vector3f(rays.directions.T.copy()))


def _done(dr: Any, *values: Any) -> tuple[Any, ...]:
    dr.eval(*values)
    dr.sync_thread()
    return values


def _picture(mi: Any, dr: Any, scene: Any, tables: mitsuba_scene.Tables, work: Workload) -> Any:
    """Rgb, depth, instance and class of each pixel with one shadow ray to the lamp, as `kernels.frame` takes them."""
    camera, rotation = work.camera, work.pose[:3, :3].astype(float)
    instances, classes = mi.UInt32(tables.instance), mi.UInt32(tables.material)
    colors, glow = mi.Float(tables.color.ravel()), mi.Float(tables.emission.ravel())

    def run() -> tuple[Any, ...]:
        index = dr.arange(mi.UInt32, work.pixels)
        x = (mi.Float(index % camera.width) + 0.5 - camera.cx) / camera.fx
        y = (mi.Float(index // camera.width) + 0.5 - camera.cy) / camera.fy
        along = mi.Vector3f(*(rotation[i, 0] * x + rotation[i, 1] * y + rotation[i, 2] for i in range(3)))
        ray = mi.Ray3f(mi.Point3f(*work.pose[:3, 3].tolist()), along)
        hit = scene.ray_intersect(ray, ray_flags=mi.RayFlags.Minimal, coherent=True)
        valid = hit.is_valid()
        shape = dr.reinterpret_array(mi.UInt32, hit.shape)
        normal = dr.select(dr.dot(hit.n, along) > 0, -hit.n, hit.n)
        point = hit.p + normal * 1e-3
        toward = mi.Point3f(*work.lamp.tolist()) - point
        shadow = mi.Ray3f(point, toward)
        shadow.maxt = mi.Float(1.0)
        clear = valid & ~scene.ray_test(shadow, coherent=True)
        distance2 = dr.squared_norm(toward)
        lit = dr.select(clear, 3.0 * dr.maximum(dr.dot(normal, toward), 0) / dr.sqrt(distance2) / dr.pi / distance2, 0)
        color = mi.Color3f(*(dr.gather(mi.Float, colors, shape * 3 + i, valid) for i in range(3)))
        glows = mi.Color3f(*(dr.gather(mi.Float, glow, shape * 3 + i, valid) for i in range(3)))
        rgb = mi.Color3f(dr.sqrt(dr.clip(color * (lit + 0.1) + glows, 0, 1))) * 255
        bytes_rgb = [mi.UInt8(mi.UInt32(rgb[i])) for i in range(3)]
        instance = dr.gather(mi.UInt32, instances, shape, valid)
        material = dr.gather(mi.UInt32, classes, shape, valid)
        _done(dr, *bytes_rgb, hit.t, instance, material)
        return (np.stack([np.array(c) for c in bytes_rgb], 1), np.array(hit.t), np.array(instance), np.array(material))

    return run
