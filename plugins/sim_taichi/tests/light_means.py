# mypy: ignore-errors
"""Light that samples of lamps add up to, for `test_light_grid`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.light import sample_light
from benchbot_sim_taichi.kernels.light_grid import sample_near
from benchbot_sim_taichi.kernels.sampling import sobol_2d
from benchbot_sim_taichi.kernels.traversal import floats


@ti.kernel
def mean_of_samples(
    near: floats, lights: floats, env: floats, lamps: ti.i32, place: floats, means: floats, count: ti.i32
):
    """Irradiance without shadows, of a place (position and normal), by power and by the grid."""
    for k in range(count):
        position = ti.math.vec3(place[0], place[1], place[2])
        normal = ti.math.vec3(place[3], place[4], place[5])
        by_power = sample_light(lights, env, 0, lamps, position, sobol_2d(k, 1))
        by_grid = sample_near(near, lights, env, 1, 0, lamps, position, normal, k, 2)
        share = 1.0 / ti.cast(count, ti.f32)
        means[0] += by_power.value.x * ti.max(normal.dot(by_power.direction), 0.0) * share
        means[1] += by_grid.value.x * ti.max(normal.dot(by_grid.direction), 0.0) * share
