"""Where the sun stands and how bright the sky is, against almanacs and measurements."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot_sim_taichi.colorimetry import COOLEST_K, HOTTEST_K, LUMINANCE, planckian
from benchbot_sim_taichi.daylight import Daylight

LUX = 1e-4


@pytest.mark.parametrize(
    ("day", "latitude_deg", "elevation_deg"),
    [(172, 23.44, 90.0), (355, 23.44, 43.1), (80, 0.0, 90.0), (172, 66.6, 46.8), (355, -33.9, 79.5)],
)
def test_the_sun_is_highest_where_the_seasons_put_it(day: int, latitude_deg: float, elevation_deg: float) -> None:
    times = [11.5 + minute / 60 for minute in range(60)]
    highest = max(Daylight(time_h, day, latitude_deg).sun_angles_deg()[1] for time_h in times)
    assert highest == pytest.approx(elevation_deg, abs=0.5)


def test_the_sun_rises_in_the_east_and_north_can_be_turned() -> None:
    equinox = Daylight(6.5, 80, 45.0)
    azimuth_deg, elevation_deg = equinox.sun_angles_deg()
    assert azimuth_deg == pytest.approx(0.0, abs=8) or azimuth_deg == pytest.approx(360.0, abs=8)
    assert 0 < elevation_deg < 8
    assert Daylight(17.5, 80, 45.0).sun_angles_deg()[0] == pytest.approx(180.0, abs=8)
    turned = Daylight(17.5, 80, 45.0, north_deg=0.0).sun_angles_deg()[0]
    assert turned == pytest.approx(90.0, abs=8)


def test_a_clear_noon_has_the_light_that_is_measured() -> None:
    """Direct normal illuminance 80 to 110 klx, sky 10 to 30 klx (CIE clear skies); sunlight is warmer than the sky."""
    noon = Daylight(12.0, 172, 45.0)
    sun = np.array(noon.sun_irradiance())
    assert 80e3 < LUMINANCE @ sun / LUX < 115e3
    above = even_hemisphere()
    sky = math.pi * noon.sky_radiance(above).mean(axis=0)
    assert 8e3 < LUMINANCE @ sky / LUX < 35e3
    assert sun[0] / sun[2] > 1.2
    assert sky[2] / sky[0] > 1.2


@pytest.mark.parametrize(("elevation_deg", "lux"), [(0.0, 400.0), (-6.0, 3.4), (-12.0, 0.008)])
def test_twilight_fades_as_measured(elevation_deg: float, lux: float) -> None:
    times = np.linspace(17.0, 23.0, 2000)
    moment = min(
        (Daylight(float(t), 80, 45.0) for t in times), key=lambda d: abs(d.sun_angles_deg()[1] - elevation_deg)
    )
    sky = math.pi * LUMINANCE @ moment.sky_radiance(even_hemisphere()).mean(axis=0)
    night_glow = 0.4
    assert sky / LUX == pytest.approx(lux + night_glow, rel=0.3, abs=0.4)
    assert max(moment.sun_irradiance()) < 0.3


@given(st.floats(0, 24), st.integers(1, 366), st.floats(-90, 90), st.floats(0, 360), st.floats(2, 10))
def test_light_is_finite_and_never_negative(
    time_h: float, day: int, latitude_deg: float, north_deg: float, turbidity: float
) -> None:
    daylight = Daylight(time_h, day, latitude_deg, north_deg, turbidity)
    directions = np.concatenate([even_hemisphere(32), [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]])
    sky = daylight.sky_radiance(directions)
    assert np.isfinite(sky).all()
    assert sky.min() >= 0
    assert min(daylight.sun_irradiance()) >= 0
    assert -90 <= daylight.sun_angles_deg()[1] <= 90


@given(st.floats(COOLEST_K, HOTTEST_K))
def test_lamps_of_all_temperatures_are_equally_bright(temperature_k: float) -> None:
    color = planckian(temperature_k)
    assert LUMINANCE @ color == pytest.approx(1.0)
    assert color.min() >= 0


def test_warm_lamps_are_orange_and_daylight_is_white() -> None:
    red, green, blue = planckian(2700.0)
    assert red > 2 * green > 6 * blue
    assert planckian(6500.0) == pytest.approx([1.0, 1.0, 1.0], abs=0.06)


def even_hemisphere(count: int = 256) -> np.ndarray:
    """Directions above the horizon, dense as the cosine."""
    index = np.arange(count)
    radius, angle = np.sqrt((index + 0.5) / count), index * 2.39996
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)], axis=1)
