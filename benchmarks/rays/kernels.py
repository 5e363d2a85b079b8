# mypy: ignore-errors
"""Our ray tracer asked the way its peers are: arrays of rays, and a picture with one shadow ray.

They run on the functions of the simulator's own kernels; only the loops are here.
"""

from typing import Any

import numpy as np

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.intrinsics import camera_records
from benchbot_sim_taichi.kernels import packet
from benchbot_sim_taichi.kernels.light import sky_radiance
from benchbot_sim_taichi.kernels.primary import camera_origin, camera_ray, locate
from benchbot_sim_taichi.kernels.surface import load3, surface_at
from benchbot_sim_taichi.kernels.traversal import floats, ints, trace, vec3
from benchbot_sim_taichi.lights import environment_record

INV_PI = 0.31830988618379067


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
    hits = np.empty(pixels * packet.HIT_STRIDE, np.float32)
    packet.meet(*device.tree, device.sheer_root, record, hits, 1, camera.width, camera.height)
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
    for i in range(count):
        hit = trace(nodes, leaves, 0, load3(origins, 3 * i), load3(directions, 3 * i), reach, True)
        blocked[i] = ti.cast(hit.triangle >= 0, ti.i32)


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
    for pixel in range(width * height):
        x, y, _, eye = locate(pixel, width, height)
        origin = camera_origin(cameras, eye)
        ray = camera_ray(cameras, eye, ti.cast(x, ti.f32) + 0.5, ti.cast(y, ti.f32) + 0.5)
        hit = packet.met(hits, pixel, 0)
        color = vec3(0.0)
        depth[pixel] = hit.t
        instance[pixel] = 0
        material[pixel] = -1
        if hit.triangle >= 0:
            surface = surface_at(
                triangles, materials, texels, images, hit.triangle, hit.u, hit.v, ray.normalized(), hit.t / cameras[12]
            )
            point = origin + ray * hit.t + surface.face * 1e-3
            toward = vec3(lamp_x, lamp_y, lamp_z) - point
            distance2 = toward.norm_sqr()
            cosine = ti.max(surface.normal.dot(toward), 0.0) / ti.sqrt(distance2)
            shadow = trace(nodes, leaves, 0, point, toward, 1.0, True)
            lit = ti.select(shadow.triangle < 0, 3.0 * cosine * INV_PI / distance2, 0.0) + 0.1
            color = surface.diffuse * lit + surface.emission
            instance[pixel] = surface.instance
            material[pixel] = ti.cast(triangles[hit.triangle * 24 + 18], ti.i32)
        for i in ti.static(range(3)):
            rgb[pixel * 3 + i] = ti.cast(ti.sqrt(ti.math.clamp(color[i], 0.0, 1.0)) * 255.0, ti.u8)
