"""The surroundings behind windows: what is seen of them, and the light that they send."""

import functools
import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.colorimetry import LUMINANCE
from benchbot_sim_taichi.exterior import panorama
from benchbot_sim_taichi.exterior.canvas import COLUMNS, TEXEL
from benchbot_sim_taichi.lighting import EXTERIORS, Exterior, Lighting
from benchbot_sim_taichi.lights import environment_record

pytestmark = pytest.mark.xdist_group("renderer")

KINDS = [kind for kind in EXTERIORS if kind != "none"]
Array = npt.NDArray[np.float64]


@pytest.fixture(scope="module", autouse=True)
def runtime(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)


record = functools.cache(environment_record)


def light(kind: str, time: str = "11:00", seed: int = 1) -> Lighting:
    return Lighting.from_mapping({"time": time, "exterior": {"kind": kind, "seed": seed}})


def seen(lighting: Lighting, directions: Array, angle: float = TEXEL) -> tuple[Array, Array]:
    """Radiance (N, 3) that a camera sees along directions (N, 3), and the coarse one."""
    from plugins.sim_taichi.tests.outlook_values import look

    found = [np.empty(directions.size, np.float32) for _ in range(2)]
    look(
        record(lighting),
        np.ascontiguousarray(directions, np.float32).ravel(),
        angle,
        *found,
        len(directions),
    )
    fine, coarse = (values.reshape(-1, 3).astype(np.float64) for values in found)
    return fine, coarse


def around_a_window(azimuth: float, count: int = 4096) -> Array:
    """Directions out of an upright window, dense as the cosine, so that the mean of radiance is irradiance / pi."""
    index = np.arange(count)
    radius, angle = np.sqrt((index + 0.5) / count), index * 2.39996
    across, up, out = radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)
    return np.stack(
        [
            out * math.cos(azimuth) - across * math.sin(azimuth),
            out * math.sin(azimuth) + across * math.cos(azimuth),
            up,
        ],
        axis=1,
    )


def test_surroundings_are_the_same_again_and_others_with_another_seed() -> None:
    one, again, other = (panorama.paint(light("trees", seed=seed)) for seed in (1, 1, 2))
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("kind", KINDS)
def test_a_window_lets_in_about_the_light_of_bare_ground_and_sky(kind: str) -> None:
    """What stands around is darker than the sky behind it: in a town a fifth of a window's light may be lost."""
    for azimuth in (0.0, 2.0, 4.0):
        fine, _ = seen(light(kind), around_a_window(azimuth))
        bare, _ = seen(light("none"), around_a_window(azimuth))
        assert 0.75 < LUMINANCE @ fine.mean(axis=0) / (LUMINANCE @ bare.mean(axis=0)) < 1.1


@pytest.mark.parametrize("kind", KINDS)
def test_what_lights_a_room_is_what_is_seen(kind: str) -> None:
    for azimuth in (0.0, 2.0, 4.0):
        fine, coarse = seen(light(kind), around_a_window(azimuth))
        assert coarse.mean(axis=0) == pytest.approx(fine.mean(axis=0), rel=0.06)


def test_a_camera_finds_the_texels_and_no_seam() -> None:
    lighting = light("town")
    radiance = panorama.paint(lighting)
    rows, columns = np.array([20, 150, 191, 192, 230, 300]), np.array([0, 1, 900, 1800, 2500, COLUMNS - 1])
    sine, azimuth = panorama.sine_of(rows), (columns + 0.5) * TEXEL
    flat = np.sqrt(1 - sine**2)
    directions = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), sine], axis=1)
    fine, _ = seen(lighting, directions)
    assert fine == pytest.approx(radiance[rows, columns].astype(np.float64), rel=0.05, abs=2e-3)
    across = np.linspace(-2e-7, 2e-7, 5)
    at_seam = np.stack([np.cos(across), np.sin(across), np.full(5, 0.3)], axis=1) / math.hypot(1.0, 0.3)
    assert np.ptp(seen(lighting, at_seam)[0], axis=0).max() < 1e-3


def test_texels_keep_the_faintest_and_the_brightest_light() -> None:
    values = (2.0 ** np.random.default_rng(0).uniform(-18, 10, (8, 8, 1))).astype(np.float32)
    values = values * np.random.default_rng(1).uniform(0.2, 1.0, (8, 8, 3)).astype(np.float32)
    bits = panorama.packed(values)[:64].view(np.uint32).reshape(8, 8)
    mantissa = np.stack([bits >> shift & 511 for shift in (0, 9, 18)], axis=-1).astype(np.float64)
    unpacked = mantissa * 2.0 ** ((bits >> 27).astype(np.float64)[..., None] - 29)
    assert (np.abs(unpacked - values) / values.max(axis=2, keepdims=True)).max() < 1 / 500


def test_small_pictures_see_means_of_texels() -> None:
    """A camera of coarse pixels sees a facade's mean instead of every other of its windows."""
    radiance = panorama.paint(light("town"))
    azimuth, sine = (np.arange(2, COLUMNS, 4)) * TEXEL, panorama.sine_of(np.full(COLUMNS // 4, 205.5))
    flat = np.sqrt(1 - sine**2)
    directions = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), sine], axis=1)
    coarse, _ = seen(light("town"), directions, 4 * TEXEL)
    means = radiance[204:208].reshape(4, -1, 4, 3).mean(axis=(0, 2))
    assert coarse == pytest.approx(means.astype(np.float64), rel=0.02, abs=0.01)


def test_windows_are_lit_by_night_and_walls_by_the_sun() -> None:
    facades = slice(194, 215)
    night, day, morning = (panorama.paint(light("town", at))[facades] @ LUMINANCE for at in ("23:00", "12:00", "07:00"))
    assert np.percentile(night, 99) > 20 * np.median(night)
    assert np.percentile(day, 99) < 20 * np.median(day)
    sun = light("town", "07:00").sun.azimuth_deg / 360
    opposite, below = (np.roll(morning, 300 - round((sun + turn) * COLUMNS), axis=1)[:, :600] for turn in (0.5, 0.0))
    assert np.median(opposite) > 1.3 * np.median(below)  # walls that face the sun are opposite of it


def test_none_is_bare_ground_and_sky() -> None:
    lighting = Lighting(exterior=Exterior("none"))
    fine, coarse = seen(lighting, around_a_window(1.0))
    assert np.array_equal(fine, coarse)
    straight_up, _ = seen(lighting, np.array([[0.0, 0.0, 1.0], [0.6, 0.0, -0.8]]))
    assert straight_up == pytest.approx(np.array([[0.5, 0.75, 1.2], [0.35, 0.33, 0.3]]), rel=0.02)


def test_a_panorama_is_painted_once(tmp_path: Path) -> None:
    lighting = light("field")
    first = environment_record(lighting, tmp_path)
    (kept,) = tmp_path.glob("outlook-*.npz")
    stamp = kept.stat().st_mtime_ns
    assert np.array_equal(first.view(np.uint32), environment_record(lighting, tmp_path).view(np.uint32))
    assert kept.stat().st_mtime_ns == stamp
    environment_record(light("field", seed=9), tmp_path)
    assert len(list(tmp_path.glob("outlook-*.npz"))) == 2
