"""The yardstick: pictures by path tracing, slow and noisy but without the approximations of `Renderer.render`."""

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.renderer import Intrinsics, Renderer


def path_trace(
    renderer: Renderer,
    camera_to_map: npt.NDArray[np.floating],
    intrinsics: Intrinsics,
    *,
    samples_per_pixel: int,
    bounces: int = 12,
    seed: int = 0,
) -> npt.NDArray[np.float32]:
    """(H, W, 3) linear sRGB radiance of what `renderer` shows, exposed like its pictures, before the tone curve."""
    from benchbot_sim_taichi.kernels import path

    device, size = renderer.device, (intrinsics.width, intrinsics.height)
    camera = _ti.upload(renderer.camera_records(np.asarray(camera_to_map)[None], intrinsics))
    total = _ti.upload(np.zeros(size[0] * size[1] * 3, np.float32))
    path.trace_paths(
        *device.tree,
        device.sheer_root,
        *device.surfaces,
        *device.lights,
        camera,
        total,
        *size,
        samples_per_pixel,
        bounces,
        seed,
    )
    gain = renderer.exposure / samples_per_pixel
    return (_ti.download(total).reshape(size[1], size[0], 3) * gain).astype(np.float32)
