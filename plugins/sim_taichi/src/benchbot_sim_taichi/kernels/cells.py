# mypy: ignore-errors
"""Irradiance stored in world-space cells: the passes that fill them once per environment.

A cell is 26 values: mean position, mean normal, irradiance (all light), irradiance by way of other surfaces,
irradiance that arrives straight from windows and lamps, radiance that leaves it, albedo, openness to the sky, whether
the sun is seen, how much it counts (the share of rays that did not start inside a solid; a tenth of it where it is set
apart), the next cell in the same place, -1 if there is none, and the kind of its points.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.cell_lookup import cell_met, cell_weight
from benchbot_sim_taichi.kernels.follow import NEAR_PANE_M, follow, mirrored_sun
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.light import sky_radiance
from benchbot_sim_taichi.kernels.light_grid import row_near, sample_near
from benchbot_sim_taichi.kernels.lightmap import light_at
from benchbot_sim_taichi.kernels.panes import pack, sent, unpack
from benchbot_sim_taichi.kernels.reflectance import mean_mirrored
from benchbot_sim_taichi.kernels.sampling import cone_direction, cosine_direction, evenly_spread, hash_u32, sobol_2d
from benchbot_sim_taichi.kernels.shading import sent_by_dull
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3
from benchbot_sim_taichi.surface_cells import CELL_STRIDE, SAMPLE_STRIDE
from benchbot_sim_taichi.tables import TRIANGLE_STRIDE

OFFSET_M = 5e-4
GAP_M = 0.25  # deeper than what lamps and furniture leave between themselves and a wall
HIDDEN_WEIGHT = 1e-3
APART_WEIGHT = 0.1
CLEAR_M = 0.03  # above what is round, or has mouldings
LEAST_WEIGHT = 1e-3
LINK_NONE = -1
GATHERED_STRIDE = 5
INV_PI = 0.31830988618379067


@ti.func
def sample_point(triangles: ti.template(), vertices: ti.template(), samples: ti.template(), sample):
    """Position of a surface sample."""
    base = sample * SAMPLE_STRIDE
    triangle = ti.cast(samples[base], ti.i32)
    u, v = samples[base + 1], samples[base + 2]
    corner = triangle * 9
    return load3(vertices, corner) * (1.0 - u - v) + load3(vertices, corner + 3) * u + load3(vertices, corner + 6) * v


@ti.func
def sample_normals(triangles: ti.template(), samples: ti.template(), sample):
    """Normals of a surface sample's side: smooth, or the face's where that is turned too far, and the face's."""
    base = sample * SAMPLE_STRIDE
    u, v, side = samples[base + 1], samples[base + 2], samples[base + 3]
    record = ti.cast(samples[base], ti.i32) * TRIANGLE_STRIDE
    face = load3(triangles, record + 15) * side
    normal = load3(triangles, record) * (1.0 - u - v)
    normal += load3(triangles, record + 3) * u + load3(triangles, record + 6) * v
    normal = (normal * side).normalized(1e-9)
    if normal.dot(face) < 0.1:
        normal = face
    return normal, face


@ti.kernel
def light_cells(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    lights: floats,
    portals: ti.i32,
    lamps: ti.i32,
    near: floats,
    vertices: floats,
    samples: floats,
    first: ints,
    apart: ints,
    direct: floats,
    cells: floats,
    count: ti.i32,
    points_per_cell: ti.i32,
    size_m: ti.f32,
    seed: ti.i32,
):
    """Mean position, normal, albedo and direct light of each cell; `direct` takes the sun's part.

    A point counts as far as it can be seen from beyond `GAP_M`: the ceiling right behind a lamp is very bright, but no
    light gets from there into the room. Cells that are `apart` (1, else 0) count little beside others.
    """
    for cell in range(count):
        begin = first[cell]
        size = first[cell + 1] - begin
        mean_position = vec3(0.0)
        mean_normal = vec3(0.0)
        albedo = vec3(0.0)
        sun = vec3(0.0)
        sees_sun = False
        straight = vec3(0.0)
        scramble = hash_u32(cell ^ seed)
        weights = 0.0
        for k in range(points_per_cell):
            sample = begin + k % size
            base = sample * SAMPLE_STRIDE
            triangle = ti.cast(samples[base], ti.i32)
            side = samples[base + 3]
            face = load3(triangles, triangle * TRIANGLE_STRIDE + 15) * side
            surface = surface_at(
                triangles,
                materials,
                texels,
                images,
                triangle,
                samples[base + 1],
                samples[base + 2],
                negated(face),
                0.01,
            )
            position = sample_point(triangles, vertices, samples, sample) + face * OFFSET_M
            out = cosine_direction(face, sobol_2d(k, hash_u32(scramble)))
            around = trace(nodes, leaves, 0, position, out, GAP_M, True)
            weight = ti.select(around.triangle >= 0, HIDDEN_WEIGHT, 1.0)
            weights += weight
            mean_position += weight * position
            mean_normal += weight * surface.normal
            mirrored = mean_mirrored(env, surface.specular, surface.roughness)
            albedo += weight * (surface.diffuse * (vec3(1.0) - mirrored) + mirrored)
            xi = sobol_2d(k, scramble)
            row = row_near(near, position, surface.normal)
            for kind in range(3):
                direction = cone_direction(load3(env, 0), env[15], xi)
                value = load3(env, 3)
                reach = FAR
                wanted = kind == 0
                if kind > 0:
                    first_light = ti.select(kind == 1, 0, portals)
                    light_count = ti.select(kind == 1, portals, lamps)
                    wanted = light_count > 0
                    if wanted:
                        light = sample_near(
                            near,
                            lights,
                            env,
                            row,
                            kind - 1,
                            first_light,
                            light_count,
                            position,
                            k,
                            scramble,
                        )
                        direction = light.direction
                        value = light.value
                        reach = ti.select(kind == 1, FAR, light.distance)
                        if kind == 1 and light.distance < NEAR_PANE_M:
                            value = vec3(0.0)
                cosine = surface.normal.dot(direction)
                if wanted and cosine > 0.0 and face.dot(direction) > 0.0 and value.max() > 0.0:
                    passed = sent(
                        nodes, leaves, sheer_root, triangles, materials, texels, images, position, direction, reach
                    )
                    if kind == 0:
                        sun += weight * passed.share * value * cosine
                        sees_sun |= passed.share.max() > 0.0
                    else:
                        straight += weight * passed.share * value * cosine
        scale = 1.0 / weights
        mean_normal = mean_normal.normalized(1e-9)
        for i in ti.static(range(3)):
            cells[cell * CELL_STRIDE + i] = mean_position[i] * scale
            cells[cell * CELL_STRIDE + 3 + i] = mean_normal[i]
            cells[cell * CELL_STRIDE + 12 + i] = straight[i] * scale
            cells[cell * CELL_STRIDE + 18 + i] = ti.min(albedo[i] * scale, 0.95)
            direct[cell * 3 + i] = sun[i] * scale
        cells[cell * CELL_STRIDE + 22] = ti.cast(sees_sun, ti.f32)
        cells[cell * CELL_STRIDE + 23] = ti.select(apart[cell] == 1, APART_WEIGHT, 1.0)


@ti.kernel
def link_cells(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    portals: ti.i32,
    vertices: floats,
    samples: floats,
    first: ints,
    grid: ints,
    cells: floats,
    layout: floats,
    links: ints,
    tints: ints,
    exposed: floats,
    places: floats,
    index: ints,
    light: ints,
    gathered: floats,
    count: ti.i32,
    rays: ti.i32,
    seed: ti.i32,
):
    """Store the cell at which each of a cell's rays ends, and what share of the light there comes (`panes.pack`).

    Others see more of points that lie open: rays count by the share of those of their point that meet nothing within
    `GAP_M` (`exposed`, one per point). `gathered` (5 per cell): radiance sum of what comes from the sky, from lamps by
    way of mirrors, and from windows, lamps and the sun by way of one surface, number of valid rays, both so weighted,
    and the share of all rays that is valid; a cell's value 21 becomes the share of these that escapes.
    """
    for cell in range(count):
        begin = first[cell]
        size = first[cell + 1] - begin
        scramble = hash_u32(cell * 2 + 1 ^ seed)
        total = vec3(0.0)
        escaped = 0.0
        valid = 0.0
        counted = 0.0
        for k in range(ti.min(size, rays)):
            normal, face = sample_normals(triangles, samples, begin + k)
            position = sample_point(triangles, vertices, samples, begin + k) + face * OFFSET_M
            own_rays = (rays - k + size - 1) // size
            own = vec3(0.0)
            own_escaped = 0.0
            own_valid = 0.0
            unhindered = 0.0
            for j in range(own_rays):
                r = k + j * size
                direction = cosine_direction(normal, sobol_2d(r, scramble))
                link = LINK_NONE
                if face.dot(direction) > 0.0:
                    end, surface = follow(
                        nodes,
                        leaves,
                        sheer_root,
                        triangles,
                        materials,
                        texels,
                        images,
                        env,
                        position,
                        direction,
                        0.0,
                        hash_u32(scramble ^ hash_u32(r)),
                        evenly_spread(r, scramble),
                    )
                    own_valid += 1.0 - ti.cast(end.is_inside, ti.f32)
                    unhindered += ti.select(0.0 <= end.first_m < GAP_M, 0.0, 1.0)
                    if end.hit.triangle >= 0 and end.is_inside == 0:
                        point = end.origin + end.direction * end.hit.t
                        link = cell_met(grid, cells, layout, point, surface.face, end.hit.t)
                        stored = light_at(
                            nodes,
                            leaves,
                            sheer_root,
                            triangles,
                            materials,
                            texels,
                            images,
                            env,
                            places,
                            index,
                            light,
                            end.hit,
                            surface.face,
                            point,
                            scramble ^ r,
                        )
                        sunlight = load3(env, 3) * (stored.sun * ti.max(surface.face.dot(load3(env, 0)), 0.0))
                        straight = (stored.irradiance + sunlight) * INV_PI
                        mirrored = end.evenly * sent_by_dull(end.direction, surface, stored)
                        own += end.share * (surface.diffuse * end.matt * straight + mirrored)
                        own += end.share * (sunlight / end.likely) * mirrored_sun(env, end.direction, surface)
                        if end.mirrors > 0:
                            own += end.share * surface.emission
                    elif end.hit.triangle < 0:
                        # Sky that is seen through a pane counts as direct light.
                        is_direct = portals > 0 and end.panes > 0 and end.mirrors == 0
                        if not is_direct or end.pane_m < NEAR_PANE_M:
                            own += end.share * sky_radiance(env, end.direction)
                        own_escaped += ti.select(is_direct or end.mirrors > 0, 0.0, 1.0)
                    tints[cell * rays + r] = pack(end.share * (end.matt * surface.diffuse + end.evenly))
                links[cell * rays + r] = link
            weight = ti.max(unhindered / ti.cast(own_rays, ti.f32), HIDDEN_WEIGHT)
            exposed[begin + k] = weight
            total += weight * own
            escaped += weight * own_escaped
            valid += weight * own_valid
            counted += own_valid
        for c in ti.static(range(3)):
            gathered[cell * GATHERED_STRIDE + c] = total[c]
        gathered[cell * GATHERED_STRIDE + 3] = valid
        gathered[cell * GATHERED_STRIDE + 4] = counted / ti.cast(rays, ti.f32)
        cells[cell * CELL_STRIDE + 21] = escaped / ti.max(valid, HIDDEN_WEIGHT)


@ti.kernel
def bounce_cells(
    first: ints,
    links: ints,
    tints: ints,
    exposed: floats,
    gathered: floats,
    before: floats,
    after: floats,
    count: ti.i32,
    rays: ti.i32,
):
    """One more bounce: irradiance by way of other surfaces, `after` from `before` (3 per cell each)."""
    for cell in range(count):
        total = vec3(0.0)
        begin = first[cell]
        size = first[cell + 1] - begin
        for r in range(rays):
            other = links[cell * rays + r]
            if other >= 0:
                radiance = load3(before, other * 3) * unpack(tints[cell * rays + r]) * INV_PI
                total += radiance * exposed[begin + r % size]
        total += load3(gathered, cell * GATHERED_STRIDE)
        valid = gathered[cell * GATHERED_STRIDE + 3]
        inv = ti.select(valid > 0.0, 1.0 / ti.max(valid, HIDDEN_WEIGHT), 0.0)
        for c in ti.static(range(3)):
            after[cell * 3 + c] = total[c] * inv / INV_PI


@ti.kernel
def smooth_cells(
    nodes: floats,
    leaves: floats,
    grid: ints,
    cells: floats,
    layout: floats,
    source: floats,
    target: floats,
    keys: ints,
    count: ti.i32,
    step: ti.i32,
):
    """Average 3 values per cell over coplanar neighbours, `step` cells apart (à-trous: Dammertz et al., 2010).

    Those behind a wall are left out. Further cells of a place keep their own.
    """
    nx, ny, nz = ti.cast(layout[4], ti.i32), ti.cast(layout[5], ti.i32), ti.cast(layout[6], ti.i32)
    for cell in range(count):
        key = keys[cell]
        side = key % 6
        z0 = key // 6 % nz
        y0 = key // 6 // nz % ny
        x0 = key // 6 // nz // ny
        base = cell * CELL_STRIDE
        position = load3(cells, base)
        normal = load3(cells, base + 3)
        total = vec3(0.0)
        weight_sum = 0.0
        for k in range(ti.select(grid[key] == cell, 125, 0)):
            dx, dy, dz = k % 5 - 2, k // 5 % 5 - 2, k // 25 - 2
            x, y, z = x0 + dx * step, y0 + dy * step, z0 + dz * step
            if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
                other = grid[((x * ny + y) * nz + z) * 6 + side]
                if other >= 0:
                    spread = ti.exp(-0.35 * ti.cast(dx * dx + dy * dy + dz * dz, ti.f32))
                    weight = spread * cell_weight(cells, other, position, normal, layout[3])
                    way = load3(cells, other * CELL_STRIDE) - position
                    away = way.norm()
                    if weight > LEAST_WEIGHT and away > 0.0:
                        between = trace(nodes, leaves, 0, position + normal * CLEAR_M, way / away, away, True)
                        weight = ti.select(between.triangle >= 0, 0.0, weight)
                    total += load3(source, other * 3) * weight
                    weight_sum += weight
        for c in ti.static(range(3)):
            target[cell * 3 + c] = ti.select(
                weight_sum > 1e-6, total[c] / ti.max(weight_sum, 1e-6), source[cell * 3 + c]
            )


@ti.kernel
def weigh_cells(cells: floats, gathered: floats, count: ti.i32):
    """Have cells count by the share of their rays that did not start inside a solid."""
    for cell in range(count):
        # Not in `link_cells`, whose rays look this value up in other cells at the same time.
        cells[cell * CELL_STRIDE + 23] *= gathered[cell * GATHERED_STRIDE + 4]


@ti.kernel
def finish_cells(cells: floats, direct: floats, indirect: floats, count: ti.i32):
    """Store the final irradiance and the radiance that leaves."""
    for cell in range(count):
        for c in ti.static(range(3)):
            straight = direct[cell * 3 + c] + cells[cell * CELL_STRIDE + 12 + c]
            bounced = ti.max(indirect[cell * 3 + c], 0.0)
            value = straight + bounced
            cells[cell * CELL_STRIDE + 6 + c] = value
            cells[cell * CELL_STRIDE + 9 + c] = bounced
            cells[cell * CELL_STRIDE + 15 + c] = value * cells[cell * CELL_STRIDE + 18 + c] * INV_PI
