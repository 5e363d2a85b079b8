# mypy: ignore-errors
"""Tests for neighbouring pixels of the same surface, which may share light."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_ray
from benchbot_sim_taichi.kernels.paint import GUIDE_STRIDE
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import FAR, vec3

MIN_ALIGNMENT = 0.85


@ti.dataclass
class PixelPlane:
    """Tangent plane of a pixel's surface; `slope` is its normal's product with the camera ray, linear in x and y."""

    normal: vec3
    offset: ti.f32
    slope: ti.f32
    slope_across: ti.f32
    slope_down: ti.f32
    tolerance: ti.f32


@ti.func
def pixel_plane(cameras: ti.template(), eye, guide: ti.template(), pixel, x, y):
    """The plane that `fit` compares neighbours with."""
    at = pixel * GUIDE_STRIDE
    normal = load3(guide, at)
    t = guide[at + 3]
    middle_x = ti.cast(x, ti.f32) + 0.5
    middle_y = ti.cast(y, ti.f32) + 0.5
    slope = normal.dot(camera_ray(cameras, eye, middle_x, middle_y))
    slope_across = normal.dot(vec3(cameras[eye], cameras[eye + 3], cameras[eye + 6])) / cameras[eye + 12]
    slope_down = normal.dot(vec3(cameras[eye + 1], cameras[eye + 4], cameras[eye + 7])) / cameras[eye + 13]
    if cameras[eye + 19] != 0.0:  # the lens bends planes; beside the pixel they are still flat enough
        slope_across = normal.dot(camera_ray(cameras, eye, middle_x + 1.0, middle_y)) - slope
        slope_down = normal.dot(camera_ray(cameras, eye, middle_x, middle_y + 1.0)) - slope
    return PixelPlane(
        normal=normal,
        offset=slope * t,
        slope=slope,
        slope_across=slope_across,
        slope_down=slope_down,
        tolerance=1.0 / (0.004 + 0.004 * t),
    )


@ti.func
def fit(guide: ti.template(), plane, dx, dy, pixel):
    """0 … 1: how well `pixel`, `dx` and `dy` away, continues the plane; its normal and its distance from it count."""
    at = pixel * GUIDE_STRIDE
    t = guide[at + 3]
    alignment = plane.normal.dot(load3(guide, at))
    slope = plane.slope + ti.cast(dx, ti.f32) * plane.slope_across + ti.cast(dy, ti.f32) * plane.slope_down
    off = ti.abs(slope * t - plane.offset) * plane.tolerance
    fits = ti.min((alignment - MIN_ALIGNMENT) * 10.0, 1.0) * ti.min(2.0 - off, 1.0)
    return ti.select((t < FAR) & (alignment > MIN_ALIGNMENT) & (off < 2.0), fits, 0.0)
