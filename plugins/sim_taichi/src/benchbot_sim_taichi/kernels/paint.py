# mypy: ignore-errors
"""Pixels: depth, instance, and the radiance of the surface in the middle of each, but for what it mirrors.

A launch takes one or many pictures of one size, one after the other, each with a camera of its own: `locate` says where
a pixel belongs. Nothing is read across the border between two pictures, so that a picture comes out the same, to the
bit, whatever it is taken together with.

A pixel's guide (`GUIDE_STRIDE` values): normal without normal map and depth of its opaque surface, what filters need.
Its shade (`SHADE_STRIDE`): radiance without what is mirrored, and a number for the surface, below -1 behind a pane. Its
kind: `ROUGH`, `GLOSSY` or `MIRROR`, with `SUN_EDGE` beside where sunshine ends and `FAINT` where next to nothing is
mirrored. Its mirror (`MIRROR_STRIDE`), unless it is `ROUGH`: normal, face normal, share of each colour mirrored,
roughness, distance along the camera ray, radiance that comes from there, specular reflectance.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.frames import INFINITY_BITS
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.lightmap import light_at
from benchbot_sim_taichi.kernels.panes import MAX_LAYERS
from benchbot_sim_taichi.kernels.reflectance import pane_reflectance
from benchbot_sim_taichi.kernels.shading import REFLECT_ROUGHNESS, compress, dull_reflection, mirrored_share, shade
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3
from benchbot_sim_taichi.tables import TRIANGLE_STRIDE

GUIDE_STRIDE = 4
SHADE_STRIDE = 4
MIRROR_STRIDE = 17
ROUGH, GLOSSY, MIRROR, SUN_EDGE, FAINT = 0, 1, 2, 4, 8
MIRROR_ROUGHNESS = 0.08
FAINT_SHARE = 0.1  # of what a surface sends by its matt lobe
MATERIALS = 512.0


@ti.func
def gloss(kind):
    """Return `ROUGH`, `GLOSSY` or `MIRROR` of a pixel's kind."""
    return kind & 3


@ti.func
def surface_number(triangles: ti.template(), triangle):
    """Return a number of a triangle's object and material."""
    base = triangle * TRIANGLE_STRIDE
    return triangles[base + 19] * MATERIALS + triangles[base + 18]


@ti.kernel
def paint(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    env: floats,
    places: floats,
    index: ints,
    light: ints,
    cameras: floats,
    guide: floats,
    shades: floats,
    mirrors: floats,
    kinds: ints,
    centers: floats,
    words: ints,
    depth_at: ti.i32,
    instance_at: ti.i32,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Fill all that the module names, and `centers` (3 per pixel): exposed radiance, compressed.

    Bits of depth go into `words` from `depth_at` on (as integers: infinity would not survive fast arithmetic),
    instances from `instance_at` on. On a GPU; on a processor, `paint_tiles` does the same.
    """
    for pixel in range(count * width * height):
        x, y, _, eye = locate(pixel, width, height)
        origin = camera_origin(cameras, eye)
        ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
        direction = ray / ray.norm()
        out = pixel * MIRROR_STRIDE
        solid_t = FAR
        near_t = FAR
        near_instance = 0
        number = -1.0
        pane_t = FAR
        pane_normal = vec3(0.0)
        pane_share = 0.0
        passed = vec3(1.0)
        kind = ROUGH
        color = outlook(env, direction, 1.0 / cameras[eye + 12])
        flat = vec3(0.0)
        even = vec3(0.0)
        sun_edge = 0
        root = 0
        start = 0.0
        layers = 0
        # First the opaque surface, then the panes and cut-outs before it, front to back.
        while root >= 0:
            hit = trace(nodes, leaves, root, origin + ray * start, ray, solid_t - start, False)
            hit.t += start
            is_sheer = root != 0
            root = ti.select(is_sheer, ti.select(hit.triangle >= 0 and layers < MAX_LAYERS, root, -1), sheer_root)
            layers += 1
            if hit.triangle >= 0:
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
                start = hit.t * 1.00001 + 1e-5
                if surface.is_cut == 0:
                    if hit.t < near_t:
                        near_t = hit.t
                        near_instance = surface.instance
                    if surface.is_glass == 1:
                        if pane_t == FAR:
                            pane_t = hit.t
                            pane_normal = surface.normal
                        share = pane_reflectance(surface.specular.x, -surface.normal.dot(direction))
                        # Further layers mirror what the first does, seen through those before them.
                        pane_share += passed.min() * share
                        passed *= surface.diffuse * (1.0 - share)
                    else:
                        root = ti.select(is_sheer, -1, root)
                        start = 0.0
                        solid_t = hit.t
                        flat = surface.smooth
                        number = surface_number(triangles, hit.triangle)
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
                            hit,
                            surface.face,
                            origin + ray * hit.t,
                            y * width + x,
                        )
                        sun_edge = stored.is_sun_edge
                        mirrored = mirrored_share(env, direction, surface.normal, surface)
                        kind = ROUGH
                        reflection = dull_reflection(direction, surface, stored)
                        if surface.roughness < REFLECT_ROUGHNESS:
                            kind = ti.select(surface.roughness <= MIRROR_ROUGHNESS, MIRROR, GLOSSY)
                            if mirrored.max() < FAINT_SHARE * surface.diffuse.max():
                                kind |= FAINT
                            even = mirrored * reflection
                            reflection = vec3(0.0)
                            for i in ti.static(range(3)):
                                mirrors[out + i] = surface.normal[i]
                                mirrors[out + 3 + i] = surface.face[i]
                                mirrors[out + 6 + i] = mirrored[i]
                                mirrors[out + 14 + i] = surface.specular[i]
                            mirrors[out + 9] = surface.roughness
                            mirrors[out + 10] = hit.t
                        color = shade(env, direction, surface, stored.irradiance, stored.sun, mirrored, reflection)
        if pane_t < FAR:
            # What is behind a pane mirrors nothing that could be told apart from what it would, were it dull.
            color = (color + even) * passed
            number = -2.0 - number
            kind = MIRROR
            for i in ti.static(range(3)):
                mirrors[out + i] = pane_normal[i]
                mirrors[out + 3 + i] = pane_normal[i]
                mirrors[out + 6 + i] = pane_share
            mirrors[out + 9] = 0.0
            mirrors[out + 10] = pane_t
        kinds[pixel] = kind | sun_edge * SUN_EDGE
        shown = compress(color * load3(cameras, eye + 16))
        for i in ti.static(range(3)):
            guide[pixel * GUIDE_STRIDE + i] = flat[i]
            shades[pixel * SHADE_STRIDE + i] = color[i]
            centers[pixel * 3 + i] = shown[i]
        guide[pixel * GUIDE_STRIDE + 3] = solid_t
        shades[pixel * SHADE_STRIDE + 3] = number
        words[depth_at + pixel] = ti.select(near_t < FAR, ti.bit_cast(near_t, ti.i32), INFINITY_BITS)
        words[instance_at + pixel] = near_instance
