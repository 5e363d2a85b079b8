# mypy: ignore-errors
"""Light that samples of lamps add up to, for `test_light_grid`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.light import point_of_light
from benchbot_sim_taichi.kernels.light_grid import row_near, sample_near, sample_row, shifted
from benchbot_sim_taichi.kernels.sampling import sobol_2d
from benchbot_sim_taichi.kernels.traversal import floats
from benchbot_sim_taichi.lights import LIGHT_STRIDE


@ti.kernel
def mean_of_samples(
    near: floats, lights: floats, env: floats, lamps: ti.i32, place: floats, means: floats, count: ti.i32
):
    """Irradiance without shadows, of a place (position and normal): by each lamp in turn, by the grid in both ways."""
    ti.loop_config(serialize=True)
    for k in range(count):
        position = ti.math.vec3(place[0], place[1], place[2])
        normal = ti.math.vec3(place[3], place[4], place[5])
        share = 1.0 / ti.cast(count, ti.f32)
        lamp = k % lamps
        density = 1.0 / (lamps * lights[lamp * LIGHT_STRIDE + 13])
        in_turn = point_of_light(lights, env, lamp, density, position, sobol_2d(k // lamps, 1))
        beside = row_near(near, shifted(near, position, normal, k), normal)
        by_grid = sample_near(near, lights, env, beside, 1, 0, lamps, position, k, 2)
        row = row_near(near, position, normal)
        by_row = sample_row(near, lights, env, row, 1, 0, lamps, position, sobol_2d(k, 3))
        means[0] += in_turn.value.x * ti.max(normal.dot(in_turn.direction), 0.0) * share
        means[1] += by_grid.value.x * ti.max(normal.dot(by_grid.direction), 0.0) * share
        if by_row.density > 0.0:
            means[2] += by_row.radiance.x / by_row.density * ti.max(normal.dot(by_row.direction), 0.0) * share
