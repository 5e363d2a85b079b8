# mypy: ignore-errors
"""Irradiance stored in world-space cells, looked up; `cells` says what a cell is and fills them."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import vec3
from benchbot_sim_taichi.surface_cells import CELL_STRIDE, SLOT

SLOT_M = 0.05  # longer than slots are wide


@ti.func
def cell_weight(cells: ti.template(), cell, point, normal, inv_size):
    """Return the weight of a stored cell for a surface element: same plane, same orientation, not buried in a solid."""
    base = cell * CELL_STRIDE
    stored = load3(cells, base + 3)
    alignment = ti.max(stored.dot(normal), 0.0)
    off_plane = ti.abs((point - load3(cells, base)).dot(normal)) * inv_size
    alignment *= alignment * cells[base + 23]
    return alignment * alignment / (1.0 + 40.0 * off_plane * off_plane)


@ti.func
def nearest_cell(grid: ti.template(), cells: ti.template(), layout: ti.template(), point, normal):
    """Return the cell with the largest weight for a surface element, -1 if there is none nearby."""
    inv_size = layout[3]
    nx, ny, nz = ti.cast(layout[4], ti.i32), ti.cast(layout[5], ti.i32), ti.cast(layout[6], ti.i32)
    local = (point - load3(layout, 0)) * inv_size
    best = -1
    # Nearly always the cell that the point lies in knows its orientation.
    ix, iy, iz = (
        ti.cast(ti.floor(local.x), ti.i32),
        ti.cast(ti.floor(local.y), ti.i32),
        ti.cast(ti.floor(local.z), ti.i32),
    )
    if 0 <= ix < nx and 0 <= iy < ny and 0 <= iz < nz:
        side = 0
        if ti.abs(normal.x) >= ti.max(ti.abs(normal.y), ti.abs(normal.z)):
            side = ti.select(normal.x < 0.0, 1, 0)
        elif ti.abs(normal.y) >= ti.abs(normal.z):
            side = ti.select(normal.y < 0.0, 3, 2)
        else:
            side = ti.select(normal.z < 0.0, 5, 4)
        best = grid[((ix * ny + iy) * nz + iz) * 6 + side]
    if best < 0:
        corner = ti.floor(local - 0.5)
        best_weight = 0.0
        for k in range(24):
            axis = k % 3
            x = ti.cast(corner.x, ti.i32) + ((k // 3) & 1)
            y = ti.cast(corner.y, ti.i32) + ((k // 6) & 1)
            z = ti.cast(corner.z, ti.i32) + k // 12
            component = ti.select(axis == 0, normal.x, ti.select(axis == 1, normal.y, normal.z))
            if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz and component * component > 0.02:
                cell = grid[((x * ny + y) * nz + z) * 6 + 2 * axis + ti.select(component < 0.0, 1, 0)]
                if cell >= 0:
                    away = (load3(cells, cell * CELL_STRIDE) - point).norm() * inv_size
                    weight = (cell_weight(cells, cell, point, normal, inv_size) + 1e-4) / (0.1 + away)
                    if weight > best_weight:
                        best_weight = weight
                        best = cell
    return best


@ti.func
def cell_met(grid: ti.template(), cells: ti.template(), layout: ti.template(), point, normal, distance):
    """Return `nearest_cell`, or of the cells in its place the one in whose midst `point` lies.

    A ray of `distance` metres met the point: from further than `SLOT_M` none meets what is in a slot.
    """
    best = nearest_cell(grid, cells, layout, point, normal)
    if best >= 0:
        other = ti.cast(cells[best * CELL_STRIDE + 24], ti.i32)
        distance2 = (load3(cells, best * CELL_STRIDE) - point).norm_sqr()
        while other >= 0:
            away2 = (load3(cells, other * CELL_STRIDE) - point).norm_sqr()
            kind = ti.cast(cells[other * CELL_STRIDE + 25], ti.i32)
            if away2 < distance2 and (kind != SLOT or distance < SLOT_M):
                best = other
                distance2 = away2
            other = ti.cast(cells[other * CELL_STRIDE + 24], ti.i32)
    return best


@ti.dataclass
class CellLight:
    """Interpolated irradiance: all of it, and that by way of other surfaces."""

    total: vec3
    bounced: vec3


@ti.func
def interpolate_cells(grid: ti.template(), cells: ti.template(), layout: ti.template(), point, normal):
    """Smooth blend of the cells around a surface element; zero where there is none."""
    inv_size = layout[3]
    nx, ny, nz = ti.cast(layout[4], ti.i32), ti.cast(layout[5], ti.i32), ti.cast(layout[6], ti.i32)
    local = (point - load3(layout, 0)) * inv_size
    corner = ti.floor(local - 0.5)
    fraction = local - 0.5 - corner
    light = CellLight(total=vec3(0.0), bounced=vec3(0.0))
    weight_sum = 0.0
    for axis in range(3):
        component = ti.select(axis == 0, normal.x, ti.select(axis == 1, normal.y, normal.z))
        if component * component > 0.02:
            side = 2 * axis + ti.select(component < 0.0, 1, 0)
            for k in range(8):
                dx, dy, dz = k & 1, (k >> 1) & 1, k >> 2
                x, y, z = ti.cast(corner.x, ti.i32) + dx, ti.cast(corner.y, ti.i32) + dy, ti.cast(corner.z, ti.i32) + dz
                if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
                    cell = grid[((x * ny + y) * nz + z) * 6 + side]
                    if cell >= 0:
                        wx = ti.select(dx == 1, fraction.x, 1.0 - fraction.x)
                        wy = ti.select(dy == 1, fraction.y, 1.0 - fraction.y)
                        wz = ti.select(dz == 1, fraction.z, 1.0 - fraction.z)
                        weight = (wx * wy * wz + 1e-4) * (
                            component * component * cell_weight(cells, cell, point, normal, inv_size) + 1e-6
                        )
                        base = cell * CELL_STRIDE
                        light.total += load3(cells, base + 6) * weight
                        light.bounced += load3(cells, base + 9) * weight
                        weight_sum += weight
    scale = ti.select(weight_sum > 0.0, 1.0 / ti.max(weight_sum, 1e-20), 0.0)
    light.total *= scale
    light.bounced *= scale
    return light
