# mypy: ignore-errors
"""Our ray tracer asked the way its peers are: arrays of rays, and a picture with one shadow ray.

They run on the functions of the simulator's own kernels; only the loops are here.
"""

import functools
from typing import Any

import numpy as np

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.intrinsics import camera_records
from benchbot_sim_taichi.kernels import first_hits
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray
from benchbot_sim_taichi.kernels.first_hits import TILE
from benchbot_sim_taichi.kernels.lanes import larger, smaller, vec16
from benchbot_sim_taichi.kernels.light import sky_radiance
from benchbot_sim_taichi.kernels.packet import RAYS, Packet, packet_from, trace_packet
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import floats, ints, trace, vec3
from benchbot_sim_taichi.lights import environment_record

INV_PI = 0.31830988618379067


def first_hits_of(renderer: Any, pose: Any, camera: Any) -> Any:
    """What each pixel's middle shows, as `first_hits` orders it: in working memory, until the next call."""
    hits = _working_memory(first_hits.hits_size(1, camera.width, camera.height))
    record = camera_records(np.asarray(pose)[None], camera)
    first_hits.meet_squares(*renderer.device.tree, -1, record, hits, 1, camera.width, camera.height)
    return hits


def distances_of(hits: Any, camera: Any) -> Any:
    """Distances (H * W,) of `first_hits_of`."""
    columns, rows = -(-camera.width // TILE), -(-camera.height // TILE)
    squares = hits.reshape(rows, columns, -1, TILE, TILE)[:, :, 0]
    picture = squares.transpose(0, 2, 1, 3).reshape(rows * TILE, columns * TILE)
    return picture[: camera.height, : camera.width].ravel()


@functools.cache
def _working_memory(size: int) -> Any:
    """Memory that stays between pictures, as the renderer's does."""
    return np.empty(size, np.float32)


def nearest(renderer: Any, origins: Any, directions: Any, reach: float) -> Any:
    """Distances (N,) in units of the directions' length, and triangles (N,), -1 where there is none."""
    count = len(origins)
    distance, triangle = np.empty(count, np.float32), np.empty(count, np.int32)
    _nearest(*renderer.device.tree, origins.ravel(), directions.ravel(), float(reach), distance, triangle, count)
    return distance, triangle


def occluded(renderer: Any, origins: Any, directions: Any, reach: float) -> Any:
    """(N,) int32, 1 where something lies between the origin and `reach` times the direction."""
    count = len(origins)
    blocked = np.empty(count, np.int32)
    _occluded(*renderer.device.tree, origins.ravel(), directions.ravel(), float(reach), blocked, count)
    return blocked


def frame(renderer: Any, pose: Any, camera: Any, lamp: Any) -> Any:
    """rgb (H, W, 3) uint8, planar depth (H, W), triangle's instance and material (H, W): one shadow ray to `lamp`."""
    pixels = camera.width * camera.height
    rgb, depth = np.empty(pixels * 3, np.uint8), np.empty(pixels, np.float32)
    instance, material = np.empty(pixels, np.int32), np.empty(pixels, np.int32)
    record = camera_records(np.asarray(pose)[None], camera)
    device = renderer.device
    hits = _working_memory(first_hits.hits_size(1, camera.width, camera.height))
    first_hits.meet_squares(*device.tree, device.sheer_root, record, hits, 1, camera.width, camera.height)
    _frame(
        *device.tree,
        *device.surfaces,
        record,
        hits,
        *(float(value) for value in lamp),
        rgb,
        depth,
        instance,
        material,
        camera.width,
        camera.height,
    )
    size = (camera.height, camera.width)
    return rgb.reshape(*size, 3), depth.reshape(size), instance.reshape(size), material.reshape(size)


def sky(lighting: Any, directions: Any) -> Any:
    """Radiance (N, 3) of the sky along unit directions (N, 3)."""
    radiance = np.empty(directions.size, np.float32)
    _sky(environment_record(lighting), np.ascontiguousarray(directions, np.float32).ravel(), radiance, len(directions))
    return radiance.reshape(-1, 3)


@ti.kernel
def _sky(env: floats, directions: floats, radiance: floats, count: ti.i32):
    for i in range(count):
        value = sky_radiance(env, load3(directions, 3 * i))
        for j in ti.static(range(3)):
            radiance[3 * i + j] = value[j]


@ti.kernel
def _nearest(
    nodes: floats,
    leaves: floats,
    origins: floats,
    directions: floats,
    reach: ti.f32,
    distance: floats,
    triangle: ints,
    count: ti.i32,
):
    for i in range(count):
        hit = trace(nodes, leaves, 0, load3(origins, 3 * i), load3(directions, 3 * i), reach, False)
        distance[i] = hit.t
        triangle[i] = hit.triangle


@ti.kernel
def _occluded(
    nodes: floats,
    leaves: floats,
    origins: floats,
    directions: floats,
    reach: ti.f32,
    blocked: ints,
    count: ti.i32,
):
    for number in range((count + RAYS - 1) // RAYS):
        first = number * RAYS
        rays = packet_from(origins, directions, first, count, reach)
        trace_packet(nodes, leaves, 0, rays, True)
        for lane in ti.static(range(RAYS)):
            if first + lane < count:
                blocked[first + lane] = ti.cast(rays.reach[lane] < 0.0, ti.i32)


@ti.kernel
def _frame(
    nodes: floats,
    leaves: floats,
    triangles: floats,
    materials: floats,
    texels: ints,
    images: ints,
    cameras: floats,
    hits: floats,
    lamp_x: ti.f32,
    lamp_y: ti.f32,
    lamp_z: ti.f32,
    rgb: ti.types.ndarray(dtype=ti.u8, ndim=1),
    depth: floats,
    instance: ints,
    material: ints,
    width: ti.i32,
    height: ti.i32,
):
    columns = (width + TILE - 1) // TILE
    for tile in range(columns * ((height + TILE - 1) // TILE)):
        start_x, start_y, start_z = vec16(0.0), vec16(0.0), vec16(0.0)
        toward_x, toward_y, toward_z = vec16(0.0), vec16(0.0), vec16(0.0)
        lamp_red, lamp_green, lamp_blue = vec16(0.0), vec16(0.0), vec16(0.0)
        red, green, blue = vec16(0.0), vec16(0.0), vec16(0.0)
        for lane in range(RAYS):
            x, y = tile % columns * TILE + lane % TILE, tile // columns * TILE + lane // TILE
            if x < width and y < height:
                pixel = y * width + x
                ray = camera_ray(cameras, 0, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
                hit = first_hits.met(hits, first_hits.place_of_hits(pixel, width, height), 0)
                depth[pixel] = hit.t
                instance[pixel] = 0
                material[pixel] = -1
                if hit.triangle >= 0:
                    surface = surface_at(
                        triangles,
                        materials,
                        texels,
                        images,
                        hit.triangle,
                        hit.u,
                        hit.v,
                        ray.normalized(),
                        hit.t / cameras[12],
                    )
                    point = camera_origin(cameras, 0) + ray * hit.t + surface.face * 1e-3
                    toward = vec3(lamp_x, lamp_y, lamp_z) - point
                    distance2 = toward.norm_sqr()
                    cosine = ti.max(surface.normal.dot(toward), 0.0) / ti.sqrt(distance2)
                    lit = surface.diffuse * (3.0 * cosine * INV_PI / distance2)
                    unlit = surface.diffuse * 0.1 + surface.emission
                    start_x[lane], start_y[lane], start_z[lane] = point.x, point.y, point.z
                    toward_x[lane], toward_y[lane], toward_z[lane] = toward.x, toward.y, toward.z
                    lamp_red[lane], lamp_green[lane], lamp_blue[lane] = lit.x, lit.y, lit.z
                    red[lane], green[lane], blue[lane] = unlit.x, unlit.y, unlit.z
                    instance[pixel] = surface.instance
                    material[pixel] = ti.cast(triangles[hit.triangle * 24 + 18], ti.i32)
        rays = Packet(x=start_x, y=start_y, z=start_z, along_x=toward_x, along_y=toward_y, along_z=toward_z)
        rays.reach = vec16(1.0)
        trace_packet(nodes, leaves, 0, rays, True)
        red = byte_of(red + ti.select(rays.reach > 0.0, lamp_red, vec16(0.0)))
        green = byte_of(green + ti.select(rays.reach > 0.0, lamp_green, vec16(0.0)))
        blue = byte_of(blue + ti.select(rays.reach > 0.0, lamp_blue, vec16(0.0)))
        for lane in range(RAYS):
            x, y = tile % columns * TILE + lane % TILE, tile // columns * TILE + lane // TILE
            if x < width and y < height:
                at = (y * width + x) * 3
                rgb[at] = ti.cast(red[lane], ti.u8)
                rgb[at + 1] = ti.cast(green[lane], ti.u8)
                rgb[at + 2] = ti.cast(blue[lane], ti.u8)


@ti.func
def byte_of(color):
    return ti.sqrt(smaller(larger(color, 0.0), 1.0)) * 255.0
