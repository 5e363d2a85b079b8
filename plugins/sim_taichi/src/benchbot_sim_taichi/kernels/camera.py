# mypy: ignore-errors
"""The origins and the directions of a camera's rays."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lens import undistort
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import vec3
from benchbot_sim_taichi.tables import CAMERA_STRIDE


@ti.func
def locate(pixel, width, height):
    """Column and row of a pixel in its picture, the picture's first pixel, the start of its camera's record."""
    picture = pixel // (width * height)
    first = picture * (width * height)
    return (pixel - first) % width, (pixel - first) // width, first, picture * CAMERA_STRIDE


@ti.func
def camera_ray(cameras: ti.template(), eye, x, y):
    """Direction through a point of the image plane with unit depth: distances along it are planar depth (REP-118).

    `eye` is where the camera's record starts.
    """
    cx = (x - cameras[eye + 14]) / cameras[eye + 12]
    cy = (y - cameras[eye + 15]) / cameras[eye + 13]
    ray = turned(cameras, eye, cx, cy)
    if cameras[eye + 19] != 0.0:
        lens_x, lens_y = undistort(cameras, eye + 20, cx, cy)
        ray = turned(cameras, eye, lens_x, lens_y)
    return ray


@ti.func
def turned(cameras: ti.template(), eye, x, y):
    """The direction of (x, y, 1) of the optical frame, in the map frame."""
    return vec3(
        cameras[eye] * x + cameras[eye + 1] * y + cameras[eye + 2],
        cameras[eye + 3] * x + cameras[eye + 4] * y + cameras[eye + 5],
        cameras[eye + 6] * x + cameras[eye + 7] * y + cameras[eye + 8],
    )


@ti.func
def camera_origin(cameras: ti.template(), eye):
    """Centre of projection."""
    return load3(cameras, eye + 9)
