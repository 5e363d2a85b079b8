"""Which lights matter where, so that a shadow ray goes to a window of its own room and not to one of another.

A house has more windows and lamps than a pixel has shadow rays. Each block of a coarse grid remembers what share of
them goes to which window, and to which lamp: in proportion to the light that they give there, seen from a few points of
the block, and a tenth by power alone, so that none is ever left out (importance sampling; Pharr, Jakob and Humphreys,
"Physically based rendering", 4th edition, section 12.6.3).
"""

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.lights import LIGHT_STRIDE
from benchbot_sim_taichi.tables import DeviceScene

HEADER = 8
BLOCK_M = 0.75
LARGEST = 8_000_000
BY_POWER = 0.1


def find(device: DeviceScene, layout: FloatArray) -> FloatArray:
    """The grid over the space of `surface_cells`' `layout`: a header and, for each block, cumulative shares of lights.

    The header (`HEADER`,) is origin, 1 / size, nx, ny, nz, number of lights; windows come first, then lamps.
    """
    _, records, portals, lamps = device.lights
    if portals + lamps == 0:
        return np.array([0, 0, 0, 1, 1, 1, 1, 0], np.float32)
    from benchbot_sim_taichi.kernels import light_grid as kernels

    extent_m = layout[4:7].astype(np.float64) * layout[7]
    size_m = max(BLOCK_M, float(np.prod(extent_m) * (portals + lamps) / LARGEST) ** (1 / 3))
    shape = np.ceil(extent_m / size_m).astype(int)
    header = np.array([*layout[:3], 1 / size_m, *shape, portals + lamps], np.float32)
    blocks = int(np.prod(shape))
    weights = _ti.upload(np.zeros(blocks * (portals + lamps), np.float32))
    env, lights = device.lights[:2]
    kernels.weigh(*device.tree, env, lights, _ti.upload(header), weights, blocks)
    given = _ti.download(weights).reshape(blocks, portals + lamps).astype(np.float64)
    by_power = _ti.download(records).reshape(-1, LIGHT_STRIDE)[:, 12].astype(np.float64)
    parts = (slice(0, portals), slice(portals, portals + lamps))
    shares = [_shares(given[:, part], by_power[part]) for part in parts if part.stop > part.start]
    return np.concatenate([header, np.concatenate(shares, axis=1).astype(np.float32).ravel()])


def _shares(given: npt.NDArray[np.float64], by_power: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Cumulative shares (blocks, lights) of lights of one kind; `by_power` are those of all the scene."""
    total = given.sum(axis=1, keepdims=True)
    cumulative = np.cumsum(np.divide(given, total, out=np.zeros_like(given), where=total > 0), axis=1)
    mixed = np.where(total > 0, (1 - BY_POWER) * cumulative + BY_POWER * by_power, by_power)
    mixed[:, -1] = 1.0
    return mixed
