# mypy: ignore-errors
"""Laser rays, and what pixels show that are then denoised."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.first_hits import place_of_hits
from benchbot_sim_taichi.kernels.glance import look
from benchbot_sim_taichi.kernels.motion import doubles
from benchbot_sim_taichi.kernels.packet import RAYS, packet_from, trace_packet
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import FAR, floats, ints, trace, vec3

FEATURE_STRIDE = 6


@ti.kernel
def find_features(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    cameras: floats,
    hits: floats,
    features: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
    has_sheer: ti.template(),
):
    """Reflectance and normal (6 values) of the opaque surface that each pixel shows; the sky's are 1 and 0."""
    for pixel in range(count * width * height):
        x, y, _, eye = locate(pixel, width, height)
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
        reflectance = vec3(1.0)
        normal = vec3(0.0)
        if seen.hit.triangle >= 0:
            surface = surface_at(
                triangles,
                materials,
                texels,
                images,
                seen.hit.triangle,
                seen.hit.u,
                seen.hit.v,
                ray.normalized(),
                seen.hit.t / cameras[eye + 12],
            )
            reflectance = ti.math.clamp(surface.diffuse + surface.specular, 0.0, 1.0)
            normal = surface.normal
        for i in ti.static(range(3)):
            features[pixel * FEATURE_STRIDE + i] = reflectance[i]
            features[pixel * FEATURE_STRIDE + 3 + i] = normal[i]


@ti.kernel
def spread_fans(poses: doubles, along: doubles, origins: floats, directions: floats, count: ti.i32, rays: ti.i32):
    """Origins and unit directions of `rays` rays of each scanner: `along` in its frame, by its pose (4 x 4)."""
    for i in range(count * rays):
        at, ray = i // rays * 16, (i - i // rays * rays) * 3
        x, y, z = along[ray], along[ray + 1], along[ray + 2]
        way_x = poses[at] * x + poses[at + 1] * y + poses[at + 2] * z
        way_y = poses[at + 4] * x + poses[at + 5] * y + poses[at + 6] * z
        way_z = poses[at + 8] * x + poses[at + 9] * y + poses[at + 10] * z
        length = ti.sqrt(way_x * way_x + way_y * way_y + way_z * way_z)
        directions[i * 3] = ti.cast(way_x / length, ti.f32)
        directions[i * 3 + 1] = ti.cast(way_y / length, ti.f32)
        directions[i * 3 + 2] = ti.cast(way_z / length, ti.f32)
        for k in ti.static(range(3)):
            origins[i * 3 + k] = ti.cast(poses[at + 4 * k + 3], ti.f32)


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
