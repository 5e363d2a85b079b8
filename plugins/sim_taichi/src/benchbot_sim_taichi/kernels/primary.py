# mypy: ignore-errors
"""Camera rays, laser rays, and the first surface that they meet.

A launch takes one or many pictures of one size, one after the other, each with a camera of its own: `locate` says where
a pixel belongs. Nothing is read across the border between two pictures, so that a picture comes out the same, to the
bit, whatever it is taken together with.

A pixel's record (`PIXEL_STRIDE` values): depth of the opaque surface (FAR none), shading normal, face normal, diffuse
and specular reflectance, roughness, depth of a pane before it (FAR none), the pane's normal, what all panes let pass
(`panes.pack`), opaque instance, emission, reflectance of one face of the pane head-on. Its guide (`GUIDE_STRIDE`
values): normal without normal map and depth again; what filters need, kept close together.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.first_hits import met
from benchbot_sim_taichi.kernels.packet import RAYS, packet_from, trace_packet
from benchbot_sim_taichi.kernels.panes import MAX_LAYERS, pack
from benchbot_sim_taichi.kernels.reflectance import pane_reflectance
from benchbot_sim_taichi.kernels.surface import Surface, load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, vec3
from benchbot_sim_taichi.tables import TRIANGLE_STRIDE

PIXEL_STRIDE = 24
GUIDE_STRIDE = 4
INFINITY_BITS = 0x7F800000


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
    pixels: floats,
    guide: floats,
    words: ints,
    depth_at: ti.i32,
    instance_at: ti.i32,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    with_surface: ti.i32,
    with_hits: ti.i32,
):
    """Depth and instance of every pixel of `count` pictures, and its record when `with_surface`.

    Its first hits are those that `first_hits.meet` left in `hits` when `with_hits`.

    Bits of depth go into `words` from `depth_at` on (as integers: infinity would not survive fast arithmetic),
    instances from `instance_at` on.
    """
    for pixel in range(count * width * height):
        x, y, _, eye = locate(pixel, width, height)
        origin = camera_origin(cameras, eye)
        ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
        length = ray.norm()
        direction = ray / length
        base = pixel * PIXEL_STRIDE
        solid_t = FAR
        sheer_t = FAR
        near_t = FAR
        near_instance = 0
        passed = vec3(1.0)
        root = 0
        start = 0.0
        layers = 0
        # First the opaque surface, then the panes and cut-outs before it, front to back.
        while root >= 0:
            hit = Hit(t=FAR, triangle=-1, u=0.0, v=0.0)
            if with_hits == 1 and layers < 2:
                hit = met(hits, pixel, layers)
            else:
                hit = trace(nodes, leaves, root, origin + ray * start, ray, solid_t - start, False)
            is_sheer = root != 0
            root = ti.select(is_sheer, ti.select(hit.triangle >= 0 and layers < MAX_LAYERS, root, -1), sheer_root)
            layers += 1
            if hit.triangle >= 0:
                t = start + hit.t
                surface = Surface(instance=ti.cast(triangles[hit.triangle * TRIANGLE_STRIDE + 19], ti.i32))
                if with_surface == 1 or is_sheer:
                    surface = surface_at(
                        triangles,
                        materials,
                        texels,
                        images,
                        hit.triangle,
                        hit.u,
                        hit.v,
                        direction,
                        t / cameras[eye + 12],
                    )
                if surface.is_cut == 0 and t < near_t:
                    near_t = t
                    near_instance = surface.instance
                is_pane = surface.is_glass == 1 and surface.is_cut == 0
                if is_pane:
                    if sheer_t == FAR:
                        sheer_t = t
                        if with_surface == 1:
                            pixels[base + 23] = surface.specular.x
                            for i in ti.static(range(3)):
                                pixels[base + 15 + i] = surface.normal[i]
                    cosine = -surface.normal.dot(direction)
                    passed *= surface.diffuse * (1.0 - pane_reflectance(surface.specular.x, cosine))
                    root = ti.select(with_surface == 1, root, -1)
                if surface.is_cut == 0 and not is_pane:
                    if is_sheer:
                        root = -1
                    solid_t = t
                    if with_surface == 1:
                        for i in ti.static(range(3)):
                            pixels[base + 1 + i] = surface.normal[i]
                            pixels[base + 4 + i] = surface.face[i]
                            pixels[base + 7 + i] = surface.diffuse[i]
                            pixels[base + 10 + i] = surface.specular[i]
                            pixels[base + 20 + i] = surface.emission[i]
                            guide[pixel * GUIDE_STRIDE + i] = surface.smooth[i]
                        pixels[base + 13] = surface.roughness
                        pixels[base + 19] = ti.cast(surface.instance, ti.f32)
                else:
                    start = t * 1.00001 + 1e-5
        if with_surface == 1:
            pixels[base] = solid_t
            guide[pixel * GUIDE_STRIDE + 3] = solid_t
            pixels[base + 14] = sheer_t
            pixels[base + 18] = ti.bit_cast(pack(passed), ti.f32)
            if solid_t == FAR:
                pixels[base + 19] = 0.0
        words[depth_at + pixel] = ti.select(near_t < FAR, ti.bit_cast(near_t, ti.i32), INFINITY_BITS)
        words[instance_at + pixel] = near_instance


@ti.kernel
def cast_rays(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    origins: floats,
    directions: floats,
    reach: ti.f32,
    distances: floats,
    count: ti.i32,
):
    """Distance to the first surface of any kind; directions are unit."""
    for i in range(count):
        origin = load3(origins, i * 3)
        direction = load3(directions, i * 3)
        nearest = FAR
        root = 0
        while root >= 0:
            hit = trace(nodes, leaves, root, origin, direction, ti.min(reach, nearest), False)
            nearest = ti.min(nearest, hit.t)
            root = ti.select(root == 0, sheer_root, -1)
        distances[i] = nearest


@ti.kernel
def cast_packets(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    origins: floats,
    directions: floats,
    reach: ti.f32,
    distances: floats,
    count: ti.i32,
):
    """The same on a processor, for rays of which neighbours have much in common."""
    for ray in range(count):  # one thread takes 512 at least, which would be many as packets
        if ray % RAYS == 0:
            rays = packet_from(origins, directions, ray, count, reach)
            root = 0
            while root >= 0:
                trace_packet(nodes, leaves, root, rays, False)
                root = ti.select(root == 0, sheer_root, -1)
            for lane in ti.static(range(RAYS)):
                if ray + lane < count:
                    distances[ray + lane] = ti.select(rays.triangle[lane] >= 0, rays.reach[lane], FAR)
