"""Pictures by path tracing: without the approximations of `realtime`, slow, and noisy until they converge."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray
from benchbot_sim_taichi import _ti, camera_response, denoise
from benchbot_sim_taichi.intrinsics import Intrinsics, camera_records
from benchbot_sim_taichi.tables import DeviceScene

if TYPE_CHECKING:
    from benchbot_sim_taichi.quality import Quality
    from benchbot_sim_taichi.renderer import Renderer

BOUNCES = 64  # white rooms have 1 % of their light from beyond 12
BRIGHTEST_BOUNCE = 100.0  # of exposed radiance: a white wall in the sun, and keeps a lucky path from owning its pixel
SAMPLES_AT_ONCE = 32
CONVERGED_BYTES = 0.5


def path_trace(
    renderer: "Renderer",
    camera_to_map: npt.NDArray[np.floating],
    intrinsics: Intrinsics,
    *,
    samples_per_pixel: int,
    bounces: int = BOUNCES,
    seed: int = 0,
    strategies: int = 0,
    brightest: float = BRIGHTEST_BOUNCE,
) -> FloatArray:
    """(H, W, 3) linear sRGB radiance of what `renderer` shows, exposed like its pictures, before the tone curve.

    `strategies` of `kernels.path` choose how lights are found; all have the same mean. What reaches the picture's
    surfaces by way of others counts up to `brightest` in each sample.
    """
    record = camera_records(np.asarray(camera_to_map)[None], intrinsics, renderer.exposure)
    size = (intrinsics.width, intrinsics.height)
    device, near = renderer.device, renderer.near_lights
    total = _trace(device, near, record, size, samples_per_pixel, bounces, seed, strategies, brightest)
    return total / np.float32(samples_per_pixel)


def expose(
    device: DeviceScene,
    near: Any,
    records: FloatArray,
    size: tuple[int, int],
    quality: "Quality",
    seen: tuple[FloatArray, FloatArray] | None,
    seed: int,
) -> FloatArray:
    """(N, H, W, 3) exposed radiance of N cameras' pictures (W, H of `size`), in the quality `path` or `reference`.

    `path` takes its samples and denoises them with the help of `seen`, reflectance and normal of what each pixel shows,
    (N, H, W, 3), unless that is None; `reference` takes samples until two halves of them differ by half a byte (root
    mean square of sRGB), at most `quality.samples`. `near` is the scene's grid of lights (`light_grid`).
    """
    pictures = []
    for number, record in enumerate(records):
        if quality.name == "reference":
            pictures.append(_converge(device, near, record, size, quality.samples, seed))
            continue
        total = _trace(device, near, record, size, quality.samples, BOUNCES, seed, 0, BRIGHTEST_BOUNCE)
        radiance = total / np.float32(quality.samples)
        pictures.append(radiance if seen is None else denoise.denoise(radiance, *(image[number] for image in seen)))
    return np.stack(pictures)


def is_denoised(quality: "Quality") -> bool:
    """Return whether pictures of this quality are denoised on this machine."""
    return quality.name == "path" and denoise.is_installed()


def features(
    device: DeviceScene, cameras: Any, hits: Any, count: int, size: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return reflectance and normal, (N, H, W, 3) each, of what the pixels of N cameras show; W and H are `size`.

    On a processor, `hits` are those of `kernels.first_hits`. The sky has reflectance 1 and no normal.
    """
    from benchbot_sim_taichi.kernels.primary import FEATURE_STRIDE, find_features

    width, height = size
    values = _ti.upload(np.zeros(count * width * height * FEATURE_STRIDE, np.float32))
    scene = (*device.tree, device.sheer_root, *device.surfaces)
    find_features(*scene, cameras, hits, values, count, width, height, device.sheer_root >= 0)
    found = _ti.download(values).reshape(count, height, width, FEATURE_STRIDE)
    return found[..., :3], found[..., 3:]


def _converge(
    device: DeviceScene, near: Any, record: FloatArray, size: tuple[int, int], most_samples: int, seed: int
) -> FloatArray:
    halves = [np.zeros((size[1], size[0], 3), np.float32), np.zeros((size[1], size[0], 3), np.float32)]
    taken = 0
    for number, samples in enumerate(_rounds(most_samples)):
        for half, share in enumerate((samples - samples // 2, samples // 2)):
            if share:
                halves[half] += _trace(
                    device, near, record, size, share, BOUNCES, seed + 2 * number + half, 0, BRIGHTEST_BOUNCE
                )
        taken += samples
        if samples > 1 and _difference_bytes(halves[0] / (taken / 2), halves[1] / (taken / 2)) < CONVERGED_BYTES:
            break
    mean: FloatArray = (halves[0] + halves[1]) / np.float32(taken)
    return mean


def _rounds(samples: int) -> Iterator[int]:
    while samples > 0:
        now = min(2 * SAMPLES_AT_ONCE, samples)
        yield now
        samples -= now


def _difference_bytes(one: FloatArray, other: FloatArray) -> float:
    """Return the estimated error of the mean of two pictures: half of their RMS difference, in 8-bit steps."""
    first, second = (
        camera_response.srgb_bytes(camera_response.filmic(half)).astype(np.float32) for half in (one, other)
    )
    return 0.5 * float(np.sqrt(np.mean((first - second) ** 2)))


def _trace(
    device: DeviceScene,
    near: Any,
    record: FloatArray,
    size: tuple[int, int],
    samples: int,
    bounces: int,
    seed: int,
    strategies: int,
    brightest: float,
) -> FloatArray:
    """(H, W, 3) sum of exposed radiance over samples."""
    from benchbot_sim_taichi.kernels import path

    width, height = size
    exposure = record.ravel()[16:19]
    total = _ti.upload(np.zeros(width * height * 3, np.float32))
    path.trace_paths(
        *device.tree,
        device.sheer_root,
        *device.surfaces,
        *device.lights,
        device.light_of,
        near,
        _ti.upload(record.ravel()),
        total,
        width,
        height,
        samples,
        bounces,
        brightest / float(exposure.max()),
        strategies,
        seed & 0x7FFFFFFF,
    )
    exposed: FloatArray = (_ti.download(total).reshape(height, width, 3) * exposure).astype(np.float32)
    return exposed
