"""From radiance to bytes: exposure, tone curve, hue."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_sim_taichi import _ti, camera_response
from benchbot_sim_taichi.camera_response import (
    BRIGHTEST,
    MIDDLE_GREY,
    develop_on_host,
    exposed,
    filmic,
    srgb_bytes,
    tone,
)
from benchbot_sim_taichi.colorimetry import LUMINANCE, planckian

pytestmark = pytest.mark.xdist_group("renderer")

CHANNEL = st.floats(0.0625, 1.0, width=32)


def test_the_tone_curve_rises_from_black_to_white_and_keeps_middle_grey() -> None:
    curve = tone(np.linspace(0, BRIGHTEST, 1000, dtype=np.float32))
    assert (np.diff(curve) > 0).all()
    assert curve[0] == pytest.approx(0.0, abs=1e-6)
    assert curve[-1] == pytest.approx(1.0, abs=1e-3)
    assert tone(np.array([0.18], np.float32))[0] == pytest.approx(0.18, abs=0.005)


def test_a_sky_a_hundred_times_as_bright_as_the_room_is_not_clipped() -> None:
    assert srgb_bytes(tone(np.array([100 * MIDDLE_GREY], np.float32)))[0] < 250


@given(st.tuples(CHANNEL, CHANNEL, CHANNEL), st.floats(-8, 5))
def test_colours_keep_their_hue_at_every_brightness(tint: tuple[float, float, float], stops: float) -> None:
    """The order of the channels and the place of the middle one between the others stay, where a byte can tell."""
    color = np.array(tint, np.float32) / max(tint)
    shown = filmic(color[None] * np.float32(2.0**stops))[0]
    low, middle, high = (shown[i] for i in np.argsort(color))
    if high - low > 0.02:
        first, between, last = np.sort(color)
        assert (middle - low) / (high - low) == pytest.approx((between - first) / (last - first), abs=0.02)
    assert shown.max() <= 1.0


@given(st.tuples(CHANNEL, CHANNEL, CHANNEL), st.floats(-9, 5))
def test_what_is_shown_goes_back_to_what_was_exposed(tint: tuple[float, float, float], stops: float) -> None:
    radiance = np.array([tint], np.float32) * np.float32(2.0**stops)
    assert exposed(filmic(radiance)) == pytest.approx(radiance, rel=1e-2, abs=1e-4)


@settings(deadline=None, max_examples=5)
@given(st.integers(0, 2**16))
def test_kernels_show_what_the_curve_says(seed: int) -> None:
    random = np.random.default_rng(seed)
    radiance = np.broadcast_to(random.uniform(0, 1, 3) * 2.0 ** random.uniform(-6, 4), (16, 16, 3)).astype(np.float32)
    brightest = 12.0  # the glare of what is brighter is bounded
    if radiance.max() < brightest:
        shown = develop_on_host(radiance)
        assert np.abs(shown.astype(int) - srgb_bytes(filmic(radiance))).max() <= 1


@pytest.fixture(scope="module", autouse=True)
def runtime(kernel_cache: Path) -> None:
    _ti.start("cpu", kernel_cache)


def test_lamps_leave_white_walls_a_little_warm() -> None:
    lit = 0.02 * planckian(2700.0)
    shown = camera_response.exposure(2e-3, lit) * lit
    assert 1.1 < shown[0] / shown[2] < 2.5
    assert shown[0] / shown[2] < 0.2 * lit[0] / lit[2]
    assert LUMINANCE @ camera_response.exposure(2e-3, np.ones(3)) == pytest.approx(
        camera_response.automatic_gain(2e-3), rel=1e-6
    )


def test_what_is_declared_is_the_gain() -> None:
    assert LUMINANCE @ camera_response.exposure(0.01, np.ones(3), 3.0) == pytest.approx(3.0)


@pytest.mark.parametrize(("width", "height"), [(1, 1), (7, 5), (16, 9), (61, 11)])
def test_sixteen_pixels_are_developed_as_each_by_itself(width: int, height: int) -> None:
    from benchbot_sim_taichi.kernels import develop

    random = np.random.default_rng(width)
    count, cells = 2, -(-width // 8) * -(-height // 8)
    radiance = random.uniform(0, 2, count * width * height * 3).astype(np.float32)
    bloom = random.uniform(0, 2, count * cells * 3).astype(np.float32)
    words = count * -(-width * height // 4) * 3
    together, alone = np.full(words + 1, -1, np.int32), np.full(words + 1, -1, np.int32)
    for expose, out in ((develop.expose_lanes, together), (develop.expose, alone)):
        expose(radiance, bloom, *camera_response.curves(), out, 0, count, width, height, 8, 0.02)
    assert together[-1] == alone[-1] == -1
    shown = (pixels[:words].view(np.uint8).reshape(count, -1)[:, : width * height * 3] for pixels in (together, alone))
    one, other = (values.astype(int) for values in shown)
    assert np.abs(one - other).max() <= 1
    assert (one != other).mean() < 0.01
