# mypy: ignore-errors
"""Pictures in one launch: depth, instances and, if wanted, colours from stored light alone.

Colours here are texture times the irradiance of `cells`, whose shadows are as fine as the cells; there are no
reflections, no shadow rays, no more than one ray through each pixel, and no bloom. Neighbouring threads take pixels of
one tile of 8 x 4, whose rays meet much the same nodes.
"""

from benchbot_sim_taichi._ti import is_on_gpu, ti
from benchbot_sim_taichi.frames import INFINITY_BITS, PIXELS_PER_GROUP, WORDS_PER_GROUP
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray
from benchbot_sim_taichi.kernels.cell_lookup import nearest_cell
from benchbot_sim_taichi.kernels.develop import bytes_, developed
from benchbot_sim_taichi.kernels.first_hits import met, place_of_hits
from benchbot_sim_taichi.kernels.lanes import absolute
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.panes import MAX_LAYERS
from benchbot_sim_taichi.kernels.reflectance import INV_PI, pane_reflectance
from benchbot_sim_taichi.kernels.shading import mirrored_share, shade
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, vec3
from benchbot_sim_taichi.surface_cells import CELL_STRIDE
from benchbot_sim_taichi.tables import CAMERA_STRIDE, TRIANGLE_STRIDE

LIFT_M = 1e-3


@ti.dataclass
class Glimpse:
    """The opaque `hit` of a ray and what lets it pass (3); distance and instance of the first surface of any kind."""

    hit: Hit
    passed: vec3
    near_t: ti.f32
    near_instance: ti.i32


@ti.func
def tiles(width, height):
    """Return the number of tiles across a picture, and in all of it."""
    across = (width + 7) >> 3
    return across, across * ((height + 3) >> 2)


@ti.func
def tile_pixel(index, width, height):
    """Return picture, column and row of a thread's pixel; outside of the picture where its edge cuts the tile."""
    across, in_all = tiles(width, height)
    tile = index >> 5
    picture = tile // in_all
    tile -= picture * in_all
    row = tile // across
    return picture, (tile - row * across) * 8 + (index & 7), row * 4 + ((index >> 3) & 3)


@ti.func
def look(
    nodes: ti.template(),
    leaves: ti.template(),
    sheer_root,
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    hits: ti.template(),
    place,
    origin,
    ray,
    pixel_angle,
    has_sheer: ti.template(),
):
    """First the opaque surface, then the panes and cut-outs before it, front to back; as in `paint.paint`.

    On a processor, `first_hits.meet` has left the first of either in `hits`, at `place`.
    """
    seen = Glimpse(hit=Hit(t=FAR, triangle=-1, u=0.0, v=0.0), passed=vec3(1.0), near_t=FAR, near_instance=0)
    root = 0
    start = 0.0
    layers = 0
    while root >= 0:
        hit = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
        if layers == 0 and not ti.static(is_on_gpu()):
            hit = met(hits, place, ti.select(root == 0, 0, 1))
        else:
            hit = trace(nodes, leaves, root, origin + ray * start, ray, seen.hit.t - start, False)
        is_sheer = root != 0
        root = ti.select(is_sheer, -1, sheer_root) if ti.static(has_sheer) else -1
        if hit.triangle >= 0:
            hit.t += start
            is_cut = 0
            is_pane = 0
            if ti.static(has_sheer):  # noqa: SIM102  decided while compiling, the other for each ray
                if is_sheer:
                    surface = surface_at(
                        triangles,
                        materials,
                        texels,
                        images,
                        hit.triangle,
                        hit.u,
                        hit.v,
                        ray.normalized(),
                        hit.t * pixel_angle,
                    )
                    is_cut = surface.is_cut
                    if is_cut == 0 and surface.is_glass == 1:
                        is_pane = 1
                        cosine = -surface.normal.dot(ray.normalized())
                        seen.passed *= surface.diffuse * (1.0 - pane_reflectance(surface.specular.x, cosine))
                    if is_cut + is_pane > 0:
                        start = hit.t * 1.00001 + 1e-5
                        layers += 1
                        root = ti.select(layers < MAX_LAYERS, sheer_root, -1)
            if is_cut == 0:
                if hit.t < seen.near_t:
                    seen.near_t = hit.t
                    seen.near_instance = ti.cast(triangles[hit.triangle * TRIANGLE_STRIDE + 19], ti.i32)
                if is_pane == 0:
                    seen.hit = hit
    return seen


@ti.func
def stored_light(grid: ti.template(), cells: ti.template(), layout: ti.template(), point, normal):
    """Irradiance of a surface element, blended from the eight cells around that face the way it mostly does."""
    nx, ny, nz = ti.cast(layout[4], ti.i32), ti.cast(layout[5], ti.i32), ti.cast(layout[6], ti.i32)
    local = (point - load3(layout, 0)) * layout[3] - 0.5
    corner = ti.floor(local)
    along = local - corner
    away = absolute(normal)
    side = ti.select(normal.z < 0.0, 5, 4)
    if away.x >= ti.max(away.y, away.z):
        side = ti.select(normal.x < 0.0, 1, 0)
    elif away.y >= away.z:
        side = ti.select(normal.y < 0.0, 3, 2)
    total = vec3(0.0)
    weights = 0.0
    for k in ti.static(range(8)):
        x = ti.cast(corner.x, ti.i32) + (k & 1)
        y = ti.cast(corner.y, ti.i32) + (k >> 1 & 1)
        z = ti.cast(corner.z, ti.i32) + (k >> 2)
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
            cell = grid[((x * ny + y) * nz + z) * 6 + side]
            if cell >= 0:
                weight = along.x if ti.static(k & 1) else 1.0 - along.x
                weight *= along.y if ti.static(k >> 1 & 1) else 1.0 - along.y
                weight *= along.z if ti.static(k >> 2) else 1.0 - along.z
                weight = (weight + 1e-4) * (cells[cell * CELL_STRIDE + 23] + 1e-3)
                total += load3(cells, cell * CELL_STRIDE + 6) * weight
                weights += weight
    if weights == 0.0:
        cell = nearest_cell(grid, cells, layout, point, normal)
        if cell >= 0:
            total = load3(cells, cell * CELL_STRIDE + 6)
            weights = 1.0
    return total / ti.max(weights, 1e-20)


@ti.kernel
def see(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    cameras: floats,
    hits: floats,
    words: ints,
    depth_at: ti.i32,
    instance_at: ti.i32,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    has_sheer: ti.template(),
):
    """Depth and instance of every pixel of `count` pictures, where `primary.see` leaves them."""
    for index in range(count * ((width + 7) >> 3) * ((height + 3) >> 2) * 32):
        picture, x, y = tile_pixel(index, width, height)
        if x < width and y < height:
            pixel = (picture * height + y) * width + x
            eye = picture * CAMERA_STRIDE
            seen = look(
                nodes,
                leaves,
                sheer_root,
                triangles,
                materials,
                texels,
                images,
                hits,
                place_of_hits(pixel, width, height),
                camera_origin(cameras, eye),
                camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5),
                1.0 / cameras[eye + 12],
                has_sheer,
            )
            words[depth_at + pixel] = ti.select(seen.near_t < FAR, ti.bit_cast(seen.near_t, ti.i32), INFINITY_BITS)
            words[instance_at + pixel] = seen.near_instance


@ti.kernel
def glance(
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
    hits: floats,
    words: ints,
    colors: ints,
    depth_at: ti.i32,
    instance_at: ti.i32,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    has_sheer: ti.template(),
):
    """The same and colours, one word for each pixel: red in its lowest byte, then green and blue."""
    for index in range(count * ((width + 7) >> 3) * ((height + 3) >> 2) * 32):
        picture, x, y = tile_pixel(index, width, height)
        if x < width and y < height:
            pixel = (picture * height + y) * width + x
            eye = picture * CAMERA_STRIDE
            origin = camera_origin(cameras, eye)
            ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
            seen = look(
                nodes,
                leaves,
                sheer_root,
                triangles,
                materials,
                texels,
                images,
                hits,
                place_of_hits(pixel, width, height),
                origin,
                ray,
                1.0 / cameras[eye + 12],
                has_sheer,
            )
            words[depth_at + pixel] = ti.select(seen.near_t < FAR, ti.bit_cast(seen.near_t, ti.i32), INFINITY_BITS)
            words[instance_at + pixel] = seen.near_instance
            direction = ray.normalized()
            color = vec3(0.0)
            if seen.hit.triangle >= 0:
                hit = seen.hit
                surface = surface_at(
                    triangles,
                    materials,
                    texels,
                    images,
                    hit.triangle,
                    hit.u,
                    hit.v,
                    direction,
                    hit.t / cameras[eye + 12],
                )
                light = stored_light(grid, cells, layout, origin + ray * hit.t + surface.face * LIFT_M, surface.smooth)
                mirrored = mirrored_share(env, direction, surface.normal, surface)
                color = shade(env, direction, surface, light, 0.0, mirrored, light * INV_PI)
            else:
                color = outlook(env, direction, 1.0 / cameras[eye + 12])
            color *= seen.passed * load3(cameras, eye + 16)
            colors[pixel] = developed(color, tones, curve)


@ti.kernel
def pack(colors: ints, words: ints, rgb_at: ti.i32, count: ti.i32, pixels: ti.i32):
    """Three bytes of each pixel's word into the `words` from `rgb_at` on, as `develop.expose` leaves them."""
    groups = (pixels + PIXELS_PER_GROUP - 1) // PIXELS_PER_GROUP
    for group in range(count * ((pixels + PIXELS_PER_GROUP - 1) // PIXELS_PER_GROUP)):
        picture = group // groups
        first = (group - picture * groups) * PIXELS_PER_GROUP
        packed = ti.Vector([0] * WORDS_PER_GROUP)
        for k in ti.static(range(PIXELS_PER_GROUP)):
            if first + k < pixels:
                color = colors[picture * pixels + first + k]
                for i in ti.static(range(3)):
                    packed[(k * 3 + i) // 4] |= (color >> (8 * i) & 255) << ((k * 3 + i) % 4 * 8)
        for i in ti.static(range(WORDS_PER_GROUP)):
            words[rgb_at + group * WORDS_PER_GROUP + i] = packed[i]
