# mypy: ignore-errors
"""Radiance that kernels find along directions, for `test_exterior`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.light import outlook, sky_radiance
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import floats


@ti.kernel
def look(env: floats, directions: floats, angle: ti.f32, seen: floats, coarse: floats, count: ti.i32):
    """What a camera sees (3 per direction), and the coarse sky."""
    for i in range(count):
        fine = outlook(env, load3(directions, i * 3), angle)
        sky = sky_radiance(env, load3(directions, i * 3))
        for c in ti.static(range(3)):
            seen[i * 3 + c] = fine[c]
            coarse[i * 3 + c] = sky[c]
