# mypy: ignore-errors
"""What `paint` does, on a processor: the pixels of a square of 4 x 4 in the lanes of vectors (`lane_shading`).

The samples of edges, too: they have a shade, a kind and a mirror each, but no guide, depth or instance. Until their
radiance is known, mirrors have what a dull surface would mirror there.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.frames import INFINITY_BITS
from benchbot_sim_taichi.kernels.camera import camera_origin
from benchbot_sim_taichi.kernels.first_hits import HITS_STRIDE, camera_rays, points_of
from benchbot_sim_taichi.kernels.lane_shading import (
    compressed,
    dull_reflections,
    mirrored_shares,
    shade_lanes,
    stored_lights,
)
from benchbot_sim_taichi.kernels.lane_surface import surfaces_at
from benchbot_sim_taichi.kernels.lanes import (
    Lanes3,
    bits_of,
    dot3,
    ints16,
    lane3,
    lanes3,
    larger,
    load16,
    product3,
    scaled3,
    select3,
    union,
    vec16,
)
from benchbot_sim_taichi.kernels.light import outlook
from benchbot_sim_taichi.kernels.lightmap import sun_share
from benchbot_sim_taichi.kernels.packet import RAYS
from benchbot_sim_taichi.kernels.paint import (
    FAINT,
    FAINT_SHARE,
    GLOSSY,
    GUIDE_STRIDE,
    MATERIALS,
    MIRROR,
    MIRROR_ROUGHNESS,
    MIRROR_STRIDE,
    ROUGH,
    SHADE_STRIDE,
    SUN_EDGE,
)
from benchbot_sim_taichi.kernels.panes import MAX_LAYERS
from benchbot_sim_taichi.kernels.reflectance import pane_reflectance
from benchbot_sim_taichi.kernels.shading import REFLECT_ROUGHNESS
from benchbot_sim_taichi.kernels.surface import instance_of, load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints, trace, vec3
from benchbot_sim_taichi.tables import CAMERA_STRIDE


@ti.kernel
def paint_tiles(
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
    pixels: ints,
    hits: floats,
    guide: floats,
    shades: floats,
    mirrors: floats,
    kinds: ints,
    centers: floats,
    words: ints,
    depth_at: ti.i32,
    instance_at: ti.i32,
    tiles: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """See `paint.paint`; first hits are those that `first_hits.meet` left in `hits` for the same points."""
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
            # First the panes and cut-outs before the opaque surface, front to back: few pixels have any.
            nearest_t = t
            nearest = triangle
            pane = ints16(0)
            pane_t = vec16(FAR)
            pane_normal = Lanes3(x=vec16(0.0), y=vec16(0.0), z=vec16(0.0))
            pane_share = vec16(0.0)
            passed = Lanes3(x=vec16(1.0), y=vec16(1.0), z=vec16(1.0))
            if sheer_root >= 0:
                sheer = bits_of(load16(hits, at + 7 * RAYS))
                if union(ti.select(sheer >= 0, ints16(1), ints16(0))) != 0:
                    for lane in range(RAYS):
                        hit = Hit(
                            t=hits[at + 4 * RAYS + lane],
                            triangle=sheer[lane],
                            u=hits[at + 5 * RAYS + lane],
                            v=hits[at + 6 * RAYS + lane],
                        )
                        way = lane3(ray, lane)
                        toward = lane3(direction, lane)
                        is_first = True
                        share = vec3(1.0)
                        layers = 0
                        while hit.triangle >= 0:
                            surface = surface_at(
                                triangles,
                                materials,
                                texels,
                                images,
                                hit.triangle,
                                hit.u,
                                hit.v,
                                toward,
                                hit.t * pixel_angle,
                            )
                            is_last = layers >= MAX_LAYERS
                            if surface.is_cut == 0:
                                if is_first:
                                    nearest_t[lane] = hit.t
                                    nearest[lane] = hit.triangle
                                    is_first = False
                                if surface.is_glass == 1:
                                    mirrored = pane_reflectance(surface.specular.x, -surface.normal.dot(toward))
                                    if pane[lane] == 0:
                                        pane[lane] = 1
                                        pane_t[lane] = hit.t
                                        pane_normal.x[lane] = surface.normal.x
                                        pane_normal.y[lane] = surface.normal.y
                                        pane_normal.z[lane] = surface.normal.z
                                    # Further layers mirror what the first does, seen through those before them.
                                    pane_share[lane] += share.min() * mirrored
                                    share *= surface.diffuse * (1.0 - mirrored)
                                else:
                                    t[lane], u[lane], v[lane], triangle[lane] = hit.t, hit.u, hit.v, hit.triangle
                                    is_last = True
                            start = hit.t * 1.00001 + 1e-5
                            hit.triangle = -1
                            if not is_last:
                                hit = trace(
                                    nodes, leaves, sheer_root, origin + way * start, way, t[lane] - start, False
                                )
                                hit.t += start
                                layers += 1
                        passed.x[lane], passed.y[lane], passed.z[lane] = share.x, share.y, share.z
            surface = surfaces_at(triangles, materials, texels, images, triangle, u, v, direction, t * pixel_angle)
            stored = stored_lights(places, index, light, triangle, surface.is_back, u, v)
            if union(stored.is_sun_edge) != 0:
                for lane in range(RAYS):
                    if stored.is_sun_edge[lane] != 0:
                        stored.sun[lane] = sun_share(
                            nodes,
                            leaves,
                            sheer_root,
                            triangles,
                            materials,
                            texels,
                            images,
                            env,
                            lane3(surface.face, lane),
                            origin + lane3(ray, lane) * t[lane],
                            points.number[lane],
                        )
            mirrored = mirrored_shares(env, direction, surface)
            gloss = ti.select(surface.roughness <= MIRROR_ROUGHNESS, ints16(MIRROR), ints16(GLOSSY))
            gloss = ti.select((surface.roughness < REFLECT_ROUGHNESS) & (triangle >= 0), gloss, ints16(ROUGH))
            most_mirrored = larger(mirrored.x, larger(mirrored.y, mirrored.z))
            most_diffuse = larger(surface.diffuse.x, larger(surface.diffuse.y, surface.diffuse.z))
            is_faint = (most_mirrored < FAINT_SHARE * most_diffuse) & (gloss != ROUGH) & (pane == 0)
            # What is behind a pane mirrors nothing that could be told apart from what it would, were it dull.
            even = dull_reflections(direction, surface, stored)
            reflection = scaled3(even, ti.select((gloss == ROUGH) | (pane != 0), vec16(1.0), vec16(0.0)))
            color = shade_lanes(env, direction, surface, stored.irradiance, stored.sun, mirrored, reflection)
            if union(ti.select(triangle < 0, ints16(1), ints16(0))) != 0:
                for lane in range(RAYS):
                    if triangle[lane] < 0:
                        sky = outlook(env, lane3(direction, lane), pixel_angle)
                        color.x[lane], color.y[lane], color.z[lane] = sky.x, sky.y, sky.z
            color = product3(color, passed)
            number = ti.select(triangle >= 0, surface.instance * MATERIALS + surface.material, vec16(-1.0))
            number = ti.select(pane != 0, -2.0 - number, number)
            kind = ti.select(pane != 0, ints16(MIRROR), gloss)
            normal = select3(pane, pane_normal, surface.normal)
            face = select3(pane, pane_normal, surface.face)
            mirrored = select3(pane, Lanes3(x=pane_share, y=pane_share, z=pane_share), mirrored)
            roughness = ti.select(pane != 0, vec16(0.0), surface.roughness)
            even = scaled3(even, ti.select(pane != 0, vec16(0.0), vec16(1.0)))
            mirror_t = ti.select(pane != 0, pane_t, t)
            bits = kind | ti.select(is_faint, ints16(FAINT), ints16(0)) | stored.is_sun_edge * SUN_EDGE
            depth = ti.select(nearest >= 0, bits_of(nearest_t), ints16(INFINITY_BITS))
            exposure = lanes3(load3(cameras, eye + 16))
            shown = compressed(product3(color, exposure))
            for lane in range(RAYS):
                place = points.place[lane]
                if place >= 0:
                    for i in ti.static(range(3)):
                        shades[place * SHADE_STRIDE + i] = lane3(color, lane)[i]
                    shades[place * SHADE_STRIDE + 3] = number[lane]
                    kinds[place] = bits[lane]
                    if kind[lane] != ROUGH:
                        out = place * MIRROR_STRIDE
                        for i in ti.static(range(3)):
                            mirrors[out + i] = lane3(normal, lane)[i]
                            mirrors[out + 3 + i] = lane3(face, lane)[i]
                            mirrors[out + 6 + i] = lane3(mirrored, lane)[i]
                            mirrors[out + 11 + i] = lane3(even, lane)[i]
                            mirrors[out + 14 + i] = lane3(surface.specular, lane)[i]
                        mirrors[out + 9] = roughness[lane]
                        mirrors[out + 10] = mirror_t[lane]
                    if pixels.shape[0] == 1:
                        for i in ti.static(range(3)):
                            guide[place * GUIDE_STRIDE + i] = lane3(surface.smooth, lane)[i]
                            centers[place * 3 + i] = lane3(shown, lane)[i]
                        guide[place * GUIDE_STRIDE + 3] = t[lane]
                        words[depth_at + place] = depth[lane]
                        near = nearest[lane]
                        words[instance_at + place] = 0
                        if near >= 0:
                            words[instance_at + place] = instance_of(triangles, near)
