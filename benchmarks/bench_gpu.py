"""The ray tracer on a GPU: one large picture and many small ones, beside Mitsuba in the same run.

python -m benchmarks.bench_gpu [--device cpu] [--triangles 20000 200000 1000000] [--json FILE]

The rooms are those of `benchmarks.rays`. Times are medians of interleaved rounds; `device` leaves pictures where they
were worked out (in memory that is used again), `host` copies them. Colours are of the quality `fast` unless said
otherwise. Mitsuba (optional, variant cuda_ad_rgb: OptiX) takes primary rays, the large picture with matt colours
(without and with a shadow ray), and, in our materials and in matt ones, paths of up to 4 segments (ours go on further
unless said otherwise). Paths have the rooms' own lamps alone for light, as Mitsuba has.
Without a GPU there is nothing to measure.
"""

import argparse
import json
import statistics
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.path_trace import path_trace
from benchbot_sim_taichi.quality import FAST, PATH, REALTIME, Quality
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.rays import scene as rooms
from benchmarks.rays.against_peers import NIGHT
from benchmarks.rays.workload import lamp_point, look

LARGE = Intrinsics.from_horizontal_fov(960, 540, 90.0)
VIEW = look((5.3, 0.7, 1.6), 139.0, -14.0)
SMALL_PIXELS = 2**24
SAMPLES = 16


@dataclass(frozen=True)
class Row:
    """One figure; `per_s` is of `unit` in a second."""

    triangles: int
    what: str
    median_ms: float
    per_s: float
    unit: str


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", choices=_ti.DEVICES, default="cuda")
    parser.add_argument("--triangles", type=int, nargs="+", default=[20_000, 200_000, 1_000_000])
    parser.add_argument("--small-pixels", type=int, default=SMALL_PIXELS, help="pixels of all small pictures together")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write the table to this file")
    options = parser.parse_args()
    if options.device == "cuda" and not find_gpu():
        print("There is no NVIDIA GPU here; --device cpu measures the same on this machine's processor.")
        return
    rows: list[Row] = []
    print(f"{'triangles':>9} {'what':44} {'ms':>9} {'per s':>12}")
    for triangles in options.triangles:
        scene = rooms.generate(triangles)
        with tempfile.TemporaryDirectory() as cache:
            jobs = ours(scene, Path(cache), options.device, options.small_pixels) | mitsuba(
                scene, Path(cache), options.small_pixels
            )
            for what, (work, unit, seconds) in measure(jobs, options.rounds).items():
                rows.append(Row(len(scene.triangles), what, 1e3 * seconds, work / seconds, unit))
                print(f"{rows[-1].triangles:9} {what:44} {rows[-1].median_ms:9.3f} {rows[-1].per_s:12,.0f} {unit}")
    if options.json:
        options.json.write_text(json.dumps([asdict(row) for row in rows], indent=1) + "\n", encoding="utf-8")


def find_gpu() -> bool:
    """Whether the driver's library is here."""
    import ctypes

    try:
        return bool(ctypes.CDLL("libcuda.so.1").cuInit(0) == 0)
    except OSError:
        return False


Job = tuple[float, str, Callable[[], Any]]


def ours(scene: SceneGeometry, cache: Path, kind: str, small_pixels: int) -> dict[str, Job]:
    """Every way in which pictures are taken."""

    def renderer(quality: Quality, lighting: Lighting) -> Renderer:
        return Renderer(scene, lighting, cache_dir=cache, device=kind, quality=quality)

    fast, full = renderer(FAST, Lighting()), renderer(REALTIME, Lighting())
    paths = renderer(Quality(PATH.name, SAMPLES), NIGHT)
    pixels = LARGE.width * LARGE.height

    def device(chosen: Renderer, poses: npt.NDArray[np.float64], camera: Intrinsics, rgb: bool) -> Callable[[], Any]:
        frames = chosen.render_on_device(poses, camera, rgb=rgb)

        def job() -> None:
            chosen.render_on_device(poses, camera, rgb=rgb, out=frames)
            _ti.ti.sync()

        return job

    one = VIEW[None]
    repeated = np.repeat(one, max(small_pixels // pixels, 1), axis=0)
    jobs: dict[str, Job] = {
        "960x540 depth, ids: device": (pixels, "rays", device(fast, one, LARGE, rgb=False)),
        f"960x540 x {len(repeated)} depth, ids: device": (
            pixels * len(repeated),
            "rays",
            device(fast, repeated, LARGE, rgb=False),
        ),
        "960x540 depth, ids: host": (1, "frames", lambda: fast.render(VIEW, LARGE, rgb=False)),
        "960x540 RGB-D, ids (fast): device": (1, "frames", device(fast, one, LARGE, rgb=True)),
        f"960x540 x {len(repeated)} RGB-D, ids (fast): device": (
            len(repeated),
            "frames",
            device(fast, repeated, LARGE, rgb=True),
        ),
        "960x540 RGB-D, ids (fast): host": (1, "frames", lambda: fast.render(VIEW, LARGE)),
        "960x540 RGB-D, ids (realtime): device": (1, "frames", device(full, one, LARGE, rgb=True)),
        "960x540 RGB-D, ids (realtime): host": (1, "frames", lambda: full.render(VIEW, LARGE)),
        f"960x540 path, {SAMPLES} spp: host": (pixels * SAMPLES, "samples", lambda: paths.render(VIEW, LARGE)),
        f"960x540 path, {SAMPLES} spp, 4 segments: host": (
            pixels * SAMPLES,
            "samples",
            lambda: path_trace(paths, VIEW, LARGE, samples_per_pixel=SAMPLES, bounces=3),
        ),
    }
    for size in (64, 128):
        camera = Intrinsics.from_horizontal_fov(size, size, 90.0)
        poses = around(max(small_pixels // size**2, 1))
        some = f"{size}x{size} x {len(poses)}"
        jobs |= {
            f"{some} depth, ids: device": (len(poses), "frames", device(fast, poses, camera, rgb=False)),
            f"{some} RGB-D, ids (fast): device": (len(poses), "frames", device(fast, poses, camera, rgb=True)),
            f"{some} RGB-D, ids (fast): host": (len(poses), "frames", partial(fast.render_batch, poses, camera)),
        }
        part = poses[:: max(len(poses) * size**2 // 2**21, 1)]
        jobs[f"{size}x{size} x {len(part)} RGB-D, ids (realtime): device"] = (
            len(part),
            "frames",
            device(full, part, camera, rgb=True),
        )
    return jobs


def around(count: int) -> npt.NDArray[np.float64]:
    """Level poses about the middle of the room, looking everywhere."""
    spread = np.random.default_rng(0).uniform(-0.3, 0.3, (count, 3))
    middle = np.array((3.0, 2.4, 1.5))
    return np.stack([look((x, y, z), 360 * k / count, 0.0) for k, (x, y, z) in enumerate((middle + spread).tolist())])


def mitsuba(scene: SceneGeometry, folder: Path, small_pixels: int) -> dict[str, Job]:
    """The large picture by Mitsuba, if it is installed and finds a GPU; left on the device."""
    if not find_gpu() or not find_spec("mitsuba"):
        print("mitsuba: not installed (pip install mitsuba), or no GPU for it")
        return {}
    mi: Any = import_module("mitsuba")
    mi.set_variant("cuda_ad_rgb")
    dr: Any = import_module("drjit")
    from benchmarks.rays import mitsuba_scene

    target, tables = mitsuba_scene.load(scene, folder)
    ours_alike, _ = mitsuba_scene.load(scene, folder, look=mitsuba_scene.gltf)
    instances, colors = mi.UInt32(tables.instance), mi.Float(tables.color.ravel())
    lamp = mi.Point3f(*lamp_point().tolist())
    origin, rotation = mi.Point3f(*VIEW[:3, 3].tolist()), VIEW[:3, :3].tolist()
    pixels = LARGE.width * LARGE.height
    index = dr.arange(mi.UInt32, pixels)
    x = (mi.Float(index % LARGE.width) + 0.5 - LARGE.cx) / LARGE.fx
    y = (mi.Float(index // LARGE.width) + 0.5 - LARGE.cy) / LARGE.fy
    ray = mi.Ray3f(origin, mi.Vector3f(*(row[0] * x + row[1] * y + row[2] for row in rotation)))
    many = max(small_pixels // pixels, 1)
    rays = mi.Ray3f(origin, mi.Vector3f(*(dr.tile(along, many) for along in ray.d)))
    dr.eval(ray, rays)
    integrator = mi.load_dict({"type": "path", "max_depth": 4, "rr_depth": 100})
    sensor = mitsuba_scene.sensor(VIEW, LARGE)
    seeds = iter(range(10**9))

    def done(*values: Any) -> None:
        dr.eval(*values)
        dr.sync_thread()

    def primary(rays: Any) -> None:
        hit = target.ray_intersect_preliminary(rays, coherent=True)
        done(hit.t, hit.prim_index, hit.shape)

    def picture(*, with_shadow: bool) -> None:
        hit = target.ray_intersect(ray, ray_flags=mi.RayFlags.Minimal, coherent=True)
        valid = hit.is_valid()
        shape = dr.reinterpret_array(mi.UInt32, hit.shape)
        normal = dr.select(dr.dot(hit.n, ray.d) > 0, -hit.n, hit.n)
        point = hit.p + normal * 1e-3
        toward = lamp - point
        lit = dr.maximum(dr.dot(normal, toward), 0) / dr.squared_norm(toward)
        if with_shadow:
            shadow = mi.Ray3f(point, toward)
            shadow.maxt = mi.Float(1.0)
            lit = dr.select(target.ray_test(shadow, active=valid, coherent=True), 0.0, lit)
        color = [dr.gather(mi.Float, colors, shape * 3 + i, valid) for i in range(3)]
        done(
            hit.t,
            dr.gather(mi.UInt32, instances, shape, valid),
            *(mi.UInt8(mi.UInt32(dr.sqrt(dr.clip(c * (lit + 0.1), 0, 1)) * 255)) for c in color),
        )

    def paths(painted: Any) -> None:
        done(mi.render(painted, sensor=sensor, integrator=integrator, spp=SAMPLES, seed=next(seeds)))

    return {
        "Mitsuba 960x540 primary: device": (pixels, "rays", partial(primary, ray)),
        f"Mitsuba 960x540 x {many} primary: device": (pixels * many, "rays", partial(primary, rays)),
        "Mitsuba 960x540 RGB-D, ids: device": (1, "frames", partial(picture, with_shadow=False)),
        "Mitsuba 960x540 RGB-D, ids, shadow ray: device": (1, "frames", partial(picture, with_shadow=True)),
        f"Mitsuba 960x540 path, {SAMPLES} spp: device": (pixels * SAMPLES, "samples", partial(paths, ours_alike)),
        f"Mitsuba 960x540 path, {SAMPLES} spp, matt: device": (pixels * SAMPLES, "samples", partial(paths, target)),
    }


def measure(jobs: Mapping[str, Job], rounds: int) -> dict[str, tuple[float, str, float]]:
    """Work, its unit and median seconds of each job, one after the other in each round."""
    seconds: dict[str, list[float]] = {what: [] for what in jobs}
    for _, _, job in jobs.values():
        job()
    for _ in range(rounds):
        for what, (_, _, job) in jobs.items():
            started_s = time.perf_counter()
            job()
            seconds[what].append(time.perf_counter() - started_s)
    return {what: (work, unit, statistics.median(seconds[what])) for what, (work, unit, _) in jobs.items()}


if __name__ == "__main__":
    main()
