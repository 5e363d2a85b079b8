"""The importance of lights by position, so that a shadow ray goes to a window of its own room, not of another.

A house has more windows and lamps than a pixel has shadow rays. Each block of a coarse grid stores, for surfaces
that face one of six directions, the share of rays for each window and lamp: in proportion to the light that it gives
to some points on those surfaces, and a part by power alone, so that none is ever left out (importance sampling; Pharr,
Jakob and Humphreys, "Physically based rendering", 4th edition, section 12.6.3).
"""

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import FloatArray
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.lights import LIGHT_STRIDE
from benchbot_sim_taichi.surface_cells import DIRECTIONS
from benchbot_sim_taichi.tables import DeviceScene

HEADER = 8
KINDS = 2
BLOCK_M = 0.75
LARGEST = 12_000_000
PLACES = 8
BY_POWER = 0.05
BY_NEIGHBOUR = 0.15
LITTLE = 0.01
SELDOM = 4

Integers = npt.NDArray[np.int64]


def find(
    device: DeviceScene, layout: FloatArray, positions: npt.NDArray[np.floating], normals: npt.NDArray[np.floating]
) -> FloatArray:
    """The grid over the space of `surface_cells`' `layout`; surfaces are points on them and their normals, (N, 3) both.

    A header (`HEADER`,): origin, 1 / size, nx, ny, nz, number of lights. Then, for each block and each way to face (+x
    -x +y -y +z -z, varying fastest), the number of a row. Then the rows: of how many samples of windows, and of lamps,
    one is taken, and cumulative shares of windows, then lamps. Row 0, by power alone, is that of blocks far from
    surfaces.
    """
    _, records, portals, lamps = device.lights
    count = portals + lamps
    if count == 0:
        return np.array([0, 0, 0, 1, 1, 1, 1, 0, *[0] * DIRECTIONS], np.float32)
    from benchbot_sim_taichi.kernels import light_grid as kernels

    size_m, shape, keys = _sort_into_blocks(layout, count, positions, normals)
    rows, places = _places(keys)
    given = np.zeros((len(rows), count), np.float32)
    if len(rows):
        surfaces = np.concatenate([positions, normals], axis=1)[places].astype(np.float32)
        weights = _ti.upload(given.ravel())
        env, lights = device.lights[:2]
        kernels.weigh(*device.tree, env, lights, _ti.upload(surfaces.ravel()), weights, len(rows), count)
        given = _blur(_ti.download(weights).reshape(given.shape), rows, shape)
    by_power = _ti.download(records).reshape(-1, LIGHT_STRIDE)[:count, 12]
    table = np.ones((len(rows) + 1, KINDS + count), np.float32)
    table[0, KINDS:] = by_power
    for kind, part in enumerate((slice(0, portals), slice(portals, count))):
        if part.stop > part.start:
            is_little = given[:, part].sum(axis=1) < LITTLE * given.sum(axis=1)
            table[1:, kind] = np.where(is_little, SELDOM, 1)
            table[1:, KINDS:][:, part] = _shares(given[:, part], by_power[part])
    header = np.array([*layout[:3], 1 / size_m, *shape, count], np.float32)
    return np.concatenate([header, _row_of_blocks(rows, shape).astype(np.float32), table.ravel()])


def _sort_into_blocks(
    layout: FloatArray, lights: int, positions: npt.NDArray[np.floating], normals: npt.NDArray[np.floating]
) -> tuple[float, Integers, Integers]:
    """Size of the blocks in metres, how many along each axis, and each point's block and way to face as one number."""
    extent_m = layout[4:7].astype(np.float64) * layout[7]
    axis = np.abs(normals).argmax(axis=1)
    way = 2 * axis + (normals[np.arange(len(normals)), axis] < 0)
    size_m = BLOCK_M
    while True:
        shape = np.ceil(extent_m / size_m).astype(np.int64)
        x, y, z = np.clip(((positions - layout[:3]) / size_m).astype(np.int64), 0, shape - 1).T
        keys = ((x * shape[1] + y) * shape[2] + z) * DIRECTIONS + way
        if len(np.unique(keys)) * lights <= LARGEST or shape.max() == 1:
            return size_m, shape, keys
        size_m *= 1.25


def _places(keys: Integers) -> tuple[Integers, Integers]:
    """The keys that there are, and `PLACES` of the points of each, evenly from all of them."""
    order = np.argsort(keys, kind="stable")
    rows, start, count = np.unique(keys[order], return_index=True, return_counts=True)
    chosen = start[:, None] + (2 * np.arange(PLACES) + 1) * count[:, None] // (2 * PLACES)
    return rows, order[chosen].ravel()


def _blur(given: FloatArray, rows: Integers, shape: Integers) -> FloatArray:
    """Each row's shares (rows, lights), and a little of those in the blocks beside it that face the same way.

    What a light gives may end within a block, between the places where it was asked for.
    """
    total = given.sum(axis=1, keepdims=True)
    shares = np.divide(given, total, out=np.zeros_like(given), where=total > 0)
    number = np.full((*shape, DIRECTIONS), -1, np.int64)
    number.reshape(-1)[rows] = np.arange(len(rows))
    block, way = np.divmod(rows, DIRECTIONS)
    mixed, weight = shares.copy(), np.ones((len(rows), 1), np.float32)
    for axis in range(3):
        for step in (1, -1):
            beside = np.stack(np.unravel_index(block, tuple(shape)), axis=1)
            beside[:, axis] += step
            inside = (beside[:, axis] >= 0) & (beside[:, axis] < shape[axis])
            x, y, z = np.clip(beside, 0, shape - 1).T
            other = np.where(inside, number[x, y, z, way], -1)
            mixed[other >= 0] += np.float32(BY_NEIGHBOUR) * shares[other[other >= 0]]
            weight[other >= 0] += np.float32(BY_NEIGHBOUR)
    blurred: FloatArray = mixed / weight
    return blurred


def _row_of_blocks(rows: Integers, shape: Integers) -> Integers:
    """The row of every block and way to face; where there is no such surface, that of a block beside it."""
    found = np.zeros((*shape, DIRECTIONS), np.int64)
    found.reshape(-1)[rows] = np.arange(1, len(rows) + 1)
    filled = found.copy()
    for axis in range(3):
        source, target = np.moveaxis(found, axis, 0), np.moveaxis(filled, axis, 0)
        target[1:] = np.where(target[1:] == 0, source[:-1], target[1:])
        target[:-1] = np.where(target[:-1] == 0, source[1:], target[:-1])
    return filled.ravel()


def _shares(given: FloatArray, by_power: FloatArray) -> FloatArray:
    """Cumulative shares (rows, lights) of lights of one kind; `by_power` are those of all the scene."""
    cumulative = np.cumsum(given, axis=1, dtype=np.float64)
    total = cumulative[:, -1:]
    relative = np.divide(cumulative, total, out=np.zeros_like(cumulative), where=total > 0)
    mixed = np.where(total > 0, (1 - BY_POWER) * relative + BY_POWER * by_power, by_power).astype(np.float32)
    mixed[:, -1] = 1.0
    return mixed
