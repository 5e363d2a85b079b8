# mypy: ignore-errors
"""What `glance.glance` does, on a processor: the pixels of a square of 4 x 4 in the lanes of vectors."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.camera_response import BRIGHTEST
from benchbot_sim_taichi.frames import INFINITY_BITS
from benchbot_sim_taichi.kernels.camera import camera_origin
from benchbot_sim_taichi.kernels.cell_lookup import nearest_cell
from benchbot_sim_taichi.kernels.develop import bytes_, place_on_curve
from benchbot_sim_taichi.kernels.first_hits import HITS_STRIDE, camera_rays, points_of
from benchbot_sim_taichi.kernels.glance import LIFT_M, look
from benchbot_sim_taichi.kernels.lane_shading import mirrored_shares, shade_lanes
from benchbot_sim_taichi.kernels.lane_surface import surfaces_at
from benchbot_sim_taichi.kernels.lanes import (
    Lanes3,
    absolute,
    bits_of,
    dot3,
    gather,
    gather_ints,
    ints16,
    lane3,
    lanes3,
    larger,
    load16,
    product3,
    scaled3,
    smaller,
    to_ints,
    union,
    vec16,
)
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.packet import RAYS
from benchbot_sim_taichi.kernels.reflectance import INV_PI
from benchbot_sim_taichi.kernels.surface import instance_of, load3
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints
from benchbot_sim_taichi.surface_cells import CELL_STRIDE
from benchbot_sim_taichi.tables import CAMERA_STRIDE


@ti.func
def stored_in_cells(
    grid: ti.template(),
    cells: ti.template(),
    layout: ti.template(),
    point: ti.template(),
    normal: ti.template(),
    is_there: ti.template(),
):
    """See `glance.stored_light`."""
    nx, ny, nz = ti.cast(layout[4], ti.i32), ti.cast(layout[5], ti.i32), ti.cast(layout[6], ti.i32)
    local_x = (point.x - layout[0]) * layout[3] - 0.5
    local_y = (point.y - layout[1]) * layout[3] - 0.5
    local_z = (point.z - layout[2]) * layout[3] - 0.5
    floor_x, floor_y, floor_z = ti.floor(local_x), ti.floor(local_y), ti.floor(local_z)
    along_x, along_y, along_z = local_x - floor_x, local_y - floor_y, local_z - floor_z
    x0, y0, z0 = to_ints(floor_x), to_ints(floor_y), to_ints(floor_z)
    away_x, away_y, away_z = absolute(normal.x), absolute(normal.y), absolute(normal.z)
    side = ti.select(normal.z < 0.0, ints16(5), ints16(4))
    by_y = ti.select(normal.y < 0.0, ints16(3), ints16(2))
    by_x = ti.select(normal.x < 0.0, ints16(1), ints16(0))
    side = ti.select(away_y >= away_z, by_y, side)
    side = ti.select(away_x >= larger(away_y, away_z), by_x, side)
    total = Lanes3(x=vec16(0.0), y=vec16(0.0), z=vec16(0.0))
    weights = vec16(0.0)
    for k in range(8):
        x, y, z = x0 + (k & 1), y0 + (k >> 1 & 1), z0 + (k >> 2)
        is_inside = ti.select(
            (x >= 0) & (x < nx) & (y >= 0) & (y < ny) & (z >= 0) & (z < nz) & (is_there != 0), ints16(1), ints16(0)
        )
        at = ti.select(is_inside != 0, ((x * ny + y) * nz + z) * 6 + side, ints16(0))
        cell = ti.select(is_inside != 0, gather_ints(grid, at), ints16(-1))
        base = ti.select(cell >= 0, cell * CELL_STRIDE, ints16(0))
        weight = ti.select((k & 1) != 0, along_x, 1.0 - along_x)
        weight *= ti.select((k >> 1 & 1) != 0, along_y, 1.0 - along_y)
        weight *= ti.select((k >> 2) != 0, along_z, 1.0 - along_z)
        weight = (weight + 1e-4) * (gather(cells, base + 23) + 1e-3)
        weight = ti.select(cell >= 0, weight, vec16(0.0))
        total.x += gather(cells, base + 6) * weight
        total.y += gather(cells, base + 7) * weight
        total.z += gather(cells, base + 8) * weight
        weights += weight
    if union(ti.select((weights == 0.0) & (is_there != 0), ints16(1), ints16(0))) != 0:
        for lane in range(RAYS):
            if weights[lane] == 0.0 and is_there[lane] != 0:
                cell = nearest_cell(grid, cells, layout, lane3(point, lane), lane3(normal, lane))
                if cell >= 0:
                    total.x[lane] = cells[cell * CELL_STRIDE + 6]
                    total.y[lane] = cells[cell * CELL_STRIDE + 7]
                    total.z[lane] = cells[cell * CELL_STRIDE + 8]
                    weights[lane] = 1.0
    return scaled3(total, 1.0 / larger(weights, vec16(1e-20)))


@ti.kernel
def glance_tiles(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    grid: ints,
    cells: floats,
    layout: floats,
    tones: floats,
    curve: bytes_,
    cameras: floats,
    pixels: ints,
    hits: floats,
    words: ints,
    colors: ints,
    depth_at: ti.i32,
    instance_at: ti.i32,
    tiles: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """See `glance.glance`; `pixels` are `first_hits.SQUARES`."""
    for member in range(tiles * RAYS):  # one thread takes 512 at least, which would be many as tiles
        if member % RAYS == 0:
            tile = member // RAYS
            points = points_of(tile, pixels, width, height)
            eye = points.picture * CAMERA_STRIDE
            origin = camera_origin(cameras, eye)
            ray = camera_rays(cameras, eye, points.x, points.y)
            direction = scaled3(ray, 1.0 / ti.sqrt(dot3(ray, ray)))
            pixel_angle = 1.0 / cameras[eye + 12]
            at = tile * HITS_STRIDE
            t = load16(hits, at)
            u = load16(hits, at + RAYS)
            v = load16(hits, at + 2 * RAYS)
            triangle = bits_of(load16(hits, at + 3 * RAYS))
            passed = Lanes3(x=vec16(1.0), y=vec16(1.0), z=vec16(1.0))
            near_t = t
            instance = ints16(0)
            # Few pixels have panes or cut-outs before the opaque surface.
            is_sheer = ints16(0)
            if sheer_root >= 0:
                is_sheer = ti.select(bits_of(load16(hits, at + 7 * RAYS)) >= 0, ints16(1), ints16(0))
            if union(is_sheer) != 0:
                for lane in range(RAYS):
                    if is_sheer[lane] != 0:
                        seen = look(
                            nodes,
                            leaves,
                            sheer_root,
                            triangles,
                            materials,
                            texels,
                            images,
                            hits,
                            at + lane,
                            origin,
                            lane3(ray, lane),
                            pixel_angle,
                            True,
                        )
                        t[lane], u[lane], v[lane] = seen.hit.t, seen.hit.u, seen.hit.v
                        triangle[lane] = seen.hit.triangle
                        near_t[lane], instance[lane] = seen.near_t, seen.near_instance
                        passed.x[lane], passed.y[lane], passed.z[lane] = seen.passed.x, seen.passed.y, seen.passed.z
            surface = surfaces_at(triangles, materials, texels, images, triangle, u, v, direction, t * pixel_angle)
            is_there = ti.select(triangle >= 0, ints16(1), ints16(0))
            reach = ti.select(triangle >= 0, t, vec16(0.0))
            point = Lanes3(
                x=origin.x + ray.x * reach + surface.face.x * LIFT_M,
                y=origin.y + ray.y * reach + surface.face.y * LIFT_M,
                z=origin.z + ray.z * reach + surface.face.z * LIFT_M,
            )
            light = stored_in_cells(grid, cells, layout, point, surface.smooth, is_there)
            mirrored = mirrored_shares(env, direction, surface)
            reflection = scaled3(light, vec16(INV_PI))
            color = shade_lanes(env, direction, surface, light, vec16(0.0), mirrored, reflection)
            if union(ti.select(triangle < 0, ints16(1), ints16(0))) != 0:
                for lane in range(RAYS):
                    if triangle[lane] < 0:
                        sky = outlook(env, lane3(direction, lane), pixel_angle)
                        color.x[lane], color.y[lane], color.z[lane] = sky.x, sky.y, sky.z
            color = product3(product3(color, passed), lanes3(load3(cameras, eye + 16)))
            brightest = smaller(larger(larger(color.x, larger(color.y, color.z)), vec16(0.0)), vec16(BRIGHTEST))
            last_tone = ti.cast(tones.shape[0] // 2 - 1, ti.f32)
            last_step = ti.cast(curve.shape[0] - 1, ti.f32)
            tone = to_ints(ti.sqrt(brightest * (1.0 / BRIGHTEST)) * last_tone + 0.5) * 2
            factor, summand = gather(tones, tone), gather(tones, tone + 1)
            red = place_on_curve(color.x * factor + summand, last_step)
            green = place_on_curve(color.y * factor + summand, last_step)
            blue = place_on_curve(color.z * factor + summand, last_step)
            for lane in range(RAYS):
                place = points.place[lane]
                if place >= 0:
                    depth = INFINITY_BITS
                    number = 0
                    if is_sheer[lane] != 0:
                        number = instance[lane]
                        if near_t[lane] < FAR:
                            depth = ti.bit_cast(near_t[lane], ti.i32)
                    elif triangle[lane] >= 0:
                        depth = ti.bit_cast(near_t[lane], ti.i32)
                        number = instance_of(triangles, triangle[lane])
                    words[depth_at + place] = depth
                    words[instance_at + place] = number
                    colors[place] = (
                        ti.cast(curve[red[lane]], ti.i32)
                        | ti.cast(curve[green[lane]], ti.i32) << 8
                        | ti.cast(curve[blue[lane]], ti.i32) << 16
                    )
