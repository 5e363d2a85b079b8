"""Collecting: each seed's place is furnished, pictured in one batch and written at once, several side by side.

A place is a file `places/SEED.npz` of the arrays that `Shots` describes; what is there already is not made again, so
that a run which was interrupted goes on, and ends with the same bytes.
"""

import json
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from benchbot.mapping import CLASS_LIST
from benchbot.plugin import BenchbotError, cache_dir, write_atomically
from benchbot.process import processors
from benchbot_baselines.places import LIGHTS, Place, draw_views, furnish, light_of

if TYPE_CHECKING:
    from benchbot_sim_taichi.renderer import Renderer

MOST_MM = 2**16 - 1
BACKGROUND = len(CLASS_LIST) - 1
INFO = "collection.json"
CANDIDATES = 5
"""So many views are drawn for each that is taken: most of a place is walls and furniture without a class."""
GLIMPSE = (80, 60)
LEAST_SHARE, LEAST_MEDIAN_M = 0.01, 1.2


@dataclass(frozen=True)
class Settings:
    """All that pictures depend on but seeds and device."""

    views: int = 40
    width: int = 640
    height: int = 480
    lights: tuple[str, ...] = tuple(LIGHTS)
    quality: str = "realtime"
    assets: str = "household"


@dataclass(frozen=True)
class Shots:
    """The pictures of one place, N of them.

    `rgb` uint8 (N, H, W, 3) sRGB; `depth_mm` uint16 (N, H, W), along the optical axis, 0 where nothing is seen;
    `instance` uint16 (N, H, W), 0 is nothing; `classes` uint8 (I,) the place in `CLASS_LIST` of each instance, the
    background's where it has no class there; `camera_to_map` (N, 4, 4), optical frames; `intrinsics` (N, 4), fx, fy,
    cx, cy in pixels whose centres are at integers; `light` its name.
    """

    rgb: NDArray[np.uint8]
    depth_mm: NDArray[np.uint16]
    instance: NDArray[np.uint16]
    classes: NDArray[np.uint8]
    camera_to_map: NDArray[np.float64]
    intrinsics: NDArray[np.float64]
    light: NDArray[np.str_]


def read_shots(path: Path) -> Shots:
    """Read the file of a place."""
    with np.load(path) as arrays:
        return Shots(**{name: arrays[name] for name in Shots.__dataclass_fields__})


def place_file(folder: Path, seed: int) -> Path:
    """Return where the pictures of a seed are kept."""
    return folder / "places" / f"{seed:06d}.npz"


def begin(folder: Path, settings: Settings) -> None:
    """Prepare a folder; raises BenchbotError when it holds pictures of other settings."""
    wanted: dict[str, Any] = json.loads(json.dumps(asdict(settings)))
    info = folder / INFO
    if info.exists() and (there := json.loads(info.read_text(encoding="utf-8"))) != wanted:
        differing = ", ".join(name for name in wanted if there.get(name) != wanted[name])
        raise BenchbotError(
            f"{folder} was collected with other settings.",
            f"They differ in: {differing or 'what was known of them'}.",
            "Give the same ones to go on with it, or another --output-location.",
        )
    (folder / "places").mkdir(parents=True, exist_ok=True)
    write_atomically(info, json.dumps(wanted, indent=2).encode())


def collect_places(
    folder: Path,
    seeds: Sequence[int],
    settings: Settings,
    device: str,
    workers: int,
    writers: Sequence[Callable[[int, Path], None]],
) -> Iterator[int]:
    """Make the file of every seed that has none, hand each to all writers, and yield the seeds, in order.

    Places are made from first to last picture by processes that share the processors and the device; `writers` are
    pickled. Raises BenchbotError when such a process is ended from outside.
    """
    spawn = multiprocessing.get_context("spawn")
    making = partial(_make, folder, settings, device, writers)
    shares = (os.getpid(), max(processors() // workers, 1))
    with ProcessPoolExecutor(workers, spawn, _begin_worker, shares) as pool:
        try:
            yield from pool.map(making, seeds)
        except BrokenProcessPool as error:
            raise BenchbotError(
                "A process that made a place was ended from outside.",
                "Mostly that is for want of memory: each of them draws a place.",
                "Start it again, with fewer --workers: places that are whole are kept.",
            ) from error
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _make(
    folder: Path, settings: Settings, device: str, writers: Sequence[Callable[[int, Path], None]], seed: int
) -> int:
    path = place_file(folder, seed)
    if not path.exists():
        shots = shoot(furnish(seed, settings.assets), settings, device)
        with whole(path) as file:
            np.savez(file, **vars(shots))
    for write in writers:
        write(seed, path)
    return seed


def _begin_worker(parent: int, threads: int) -> None:
    """Draw with so many threads, unless the user says how many, and end this process when its parent has ended.

    A pool's workers would wait for ever for a parent that was killed.
    """
    from benchbot_sim_taichi import _ti

    os.environ.setdefault(_ti.THREADS, str(threads))

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def shoot(place: Place, settings: Settings, device: str) -> Shots:
    """Take all pictures of a place in one batch."""
    light = light_of(place.seed, settings.lights)
    with TemporaryDirectory() as scratch:
        return _shots(place, light, settings, _renderer(place, light, settings, device, Path(scratch)))


def _renderer(place: Place, light: str, settings: Settings, device: str, scratch: Path) -> "Renderer":
    """Return what draws a place: kernels and skies are kept for other places, light in `scratch`, 60 MB, used once."""
    from benchbot_scenes.generator.files import LIGHTING
    from benchbot_sim_taichi import _ti
    from benchbot_sim_taichi.lighting import Lighting
    from benchbot_sim_taichi.lights import environment_record
    from benchbot_sim_taichi.quality import QUALITIES
    from benchbot_sim_taichi.renderer import Renderer

    kept = cache_dir()
    _ti.start(device, kept)
    # Processes that the renderer starts look there for their kernels.
    (scratch / "kernels").symlink_to(kept / "kernels", target_is_directory=True)
    lighting = Lighting.from_mapping({**LIGHTING, **LIGHTS[light]})
    environment_record(lighting, kept)
    for outlook in kept.glob("outlook-*.npz"):
        (scratch / outlook.name).symlink_to(outlook)
    quality = QUALITIES[settings.quality]
    return Renderer(place.scene, lighting, cache_dir=scratch, device=device, quality=quality)


def _shots(place: Place, light: str, settings: Settings, renderer: "Renderer") -> Shots:
    from benchbot_sim_taichi.renderer import Intrinsics

    classes = np.full(max(each.index for each in place.scene.instances) + 1, BACKGROUND, np.uint8)
    for each in place.scene.instances:
        if each.class_name in CLASS_LIST:
            classes[each.index] = CLASS_LIST.index(each.class_name)
    drawn = draw_views(place, settings.views * CANDIDATES)
    glimpses = renderer.render_batch(
        np.stack([view.camera_to_map for view in drawn]),
        [Intrinsics.from_horizontal_fov(*GLIMPSE, view.width_deg) for view in drawn],
        rgb=False,
    )
    views = [drawn[row] for row in telling(glimpses.instance, glimpses.depth_m, classes)[: settings.views]]
    poses = np.stack([view.camera_to_map for view in views])
    cameras = [Intrinsics.from_horizontal_fov(settings.width, settings.height, view.width_deg) for view in views]
    batch = renderer.render_batch(poses, cameras)
    return Shots(
        batch.rgb,
        np.stack([_millimetres(depth_m) for depth_m in batch.depth_m]),
        batch.instance.astype(np.uint16),
        classes,
        poses,
        np.array([(each.fx, each.fy, each.cx - 0.5, each.cy - 0.5) for each in cameras]),
        np.array(light),
    )


def _millimetres(depth_m: NDArray[np.float32]) -> NDArray[np.uint16]:
    millimetres = np.where(np.isfinite(depth_m), depth_m, 0) * 1000
    return np.where(millimetres > MOST_MM, 0, np.rint(np.minimum(millimetres, MOST_MM))).astype(np.uint16)


def telling(
    instance: NDArray[np.integer[Any]], depth_m: NDArray[np.floating[Any]], classes: NDArray[np.uint8]
) -> list[int]:
    """Return the numbers of pictures (N, H, W), in order: first those that show an object and stand off the walls.

    Within either group they stay as they were drawn, so that the nearest and largest objects are not preferred.
    """
    labelled = (classes[instance] < BACKGROUND).mean((1, 2)) >= LEAST_SHARE
    distant = np.median(np.where(np.isfinite(depth_m), depth_m, 0), (1, 2)) >= LEAST_MEDIAN_M
    order: list[int] = np.argsort(~(labelled & distant), kind="stable").tolist()
    return order


@contextmanager
def whole(path: Path) -> Iterator[IO[bytes]]:
    """Let a file be there once all of it has been written."""
    # Of one name, so that nothing is left of a process that was killed.
    unfinished = path.with_suffix(".part")
    with unfinished.open("wb") as file:
        yield file
    unfinished.replace(path)
