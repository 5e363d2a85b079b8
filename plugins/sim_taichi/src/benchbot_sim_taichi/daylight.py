"""Sun and sky by place, date and time of day.

One unit of radiance is 10,000 cd/m², one of irradiance 10,000 lx: a clear noon has a sun of about 10 and a sky of
about 1. Preetham, Shirley and Smits, "A practical analytic model for daylight", 1999, gives the sky while the sun is
up. In twilight the sky of sunset fades as illuminance does (Bond and Henderson, "The conquest of darkness", 1963);
what stays at night is the faint glow over a town.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi.colorimetry import LUMINANCE, linear_srgb, planckian

Array = npt.NDArray[np.float64]

KILOCANDELAS = 0.1  # one kcd/m² in units of radiance
SUN_ABOVE_THE_AIR = 13.3  # solar illuminance constant, 133 klx
SUN_TEMPERATURE_K = 5778.0
PRIMARIES_UM = np.array([0.612, 0.549, 0.465])  # dominant wavelengths of sRGB's primaries
GROUND_REFLECTANCE = np.array([0.20, 0.20, 0.17])
TWILIGHT_DEPRESSION_DEG = (0.0, 6.0, 12.0, 18.0)
TWILIGHT_LOG10_LUX = (2.6, 0.53, -2.1, -3.22)
LOW_SUN_DEG = 8.0
NIGHT_ZENITH = np.array([1.6e-6, 1.7e-6, 2.2e-6])
NIGHT_HORIZON = np.array([1.3e-5, 1.05e-5, 0.8e-5])


@dataclass(frozen=True)
class Daylight:
    """A place and a time; `time_h` is local mean solar time, `day` counts from 1 January (1), latitude is north.

    `north_deg` is where north lies in the map frame, counter-clockwise from +x. `turbidity` is that of Preetham: 2 is
    very clear, 3 clear, 6 hazy.
    """

    time_h: float
    day: int
    latitude_deg: float
    north_deg: float = 90.0
    turbidity: float = 3.0

    def sun_angles_deg(self) -> tuple[float, float]:
        """Azimuth (counter-clockwise from +x, map frame) and elevation of the sun, in degrees.

        Spencer, "Fourier series representation of the position of the sun", Search 2 (1971); good to about 0.1 degree
        between the polar circles. Refraction is left out.
        """
        year = 2 * math.pi * (self.day - 1) / 365
        declination = (
            0.006918
            - 0.399912 * math.cos(year)
            + 0.070257 * math.sin(year)
            - 0.006758 * math.cos(2 * year)
            + 0.000907 * math.sin(2 * year)
            - 0.002697 * math.cos(3 * year)
            + 0.001480 * math.sin(3 * year)
        )
        equation_of_time_h = (12 / math.pi) * (
            0.000075
            + 0.001868 * math.cos(year)
            - 0.032077 * math.sin(year)
            - 0.014615 * math.cos(2 * year)
            - 0.040849 * math.sin(2 * year)
        )
        hour = (self.time_h + equation_of_time_h - 12) * math.pi / 12
        latitude = math.radians(self.latitude_deg)
        east = -math.cos(declination) * math.sin(hour)
        north = math.cos(latitude) * math.sin(declination) - math.sin(latitude) * math.cos(declination) * math.cos(hour)
        up = math.sin(latitude) * math.sin(declination) + math.cos(latitude) * math.cos(declination) * math.cos(hour)
        azimuth_deg = self.north_deg - math.degrees(math.atan2(east, north))
        return azimuth_deg % 360.0, math.degrees(math.asin(max(-1.0, min(1.0, up))))

    def sun_irradiance(self) -> tuple[float, float, float]:
        """Linear sRGB irradiance on a plane that faces the sun: sunlight less what air and haze scatter away.

        Rayleigh and Ångström extinction as Preetham et al. give them, at the wavelengths of the primaries.
        """
        _, elevation_deg = self.sun_angles_deg()
        if elevation_deg <= 0.0:
            return (0.0, 0.0, 0.0)
        # Kasten, "A new table and approximation formula for the relative optical air mass", 1965.
        mass = 1.0 / (math.sin(math.radians(elevation_deg)) + 0.15 * (elevation_deg + 3.885) ** -1.253)
        haze = 0.04608 * self.turbidity - 0.04586
        passed = np.exp(-mass * (0.008735 * PRIMARIES_UM**-4.08 + haze * PRIMARIES_UM**-1.3))
        red, green, blue = SUN_ABOVE_THE_AIR * planckian(SUN_TEMPERATURE_K) * passed
        return (float(red), float(green), float(blue))

    def sky_radiance(self, direction: Array) -> Array:
        """(N, 3) linear sRGB radiance along (N, 3) unit directions of the map frame; the ground below the horizon."""
        sky = self._above(direction)
        is_ground = direction[:, 2] < 0
        if is_ground.any():
            sky[is_ground] = self.ground_radiance()
        return sky

    def ground_radiance(self) -> Array:
        """(3,) what the ground sends back of sun and sky."""
        upward = even_hemisphere()
        from_sky = math.pi * self._above(upward).mean(axis=0)
        _, elevation_deg = self.sun_angles_deg()
        from_sun = np.array(self.sun_irradiance()) * max(math.sin(math.radians(elevation_deg)), 0.0)
        ground: Array = GROUND_REFLECTANCE / math.pi * (from_sky + from_sun)
        return ground

    def _above(self, direction: Array) -> Array:
        azimuth_deg, elevation_deg = self.sun_angles_deg()
        day = _preetham(direction, math.radians(azimuth_deg), math.radians(max(elevation_deg, 0.0)), self.turbidity)
        if elevation_deg < LOW_SUN_DEG:  # where the model is too bright: it is to meet what is measured at sunset
            sunset = math.pi * LUMINANCE @ _preetham(even_hemisphere(), 0.0, 0.0, self.turbidity).mean(axis=0)
            at_sunset: float = TWILIGHT_LOG10_LUX[0] - 4.0 - math.log10(sunset)
            faded = np.interp(-elevation_deg, TWILIGHT_DEPRESSION_DEG, TWILIGHT_LOG10_LUX) - TWILIGHT_LOG10_LUX[0]
            day *= 10 ** (at_sunset * (1.0 - max(elevation_deg, 0.0) / LOW_SUN_DEG) + faded)
        height = np.sqrt(np.clip(direction[:, 2:], 0.0, 1.0))
        sky: Array = day + NIGHT_HORIZON + (NIGHT_ZENITH - NIGHT_HORIZON) * height
        return sky


def _preetham(direction: Array, azimuth: float, elevation: float, turbidity: float) -> Array:
    """(N, 3) linear sRGB radiance of a clear sky; the numbers are those of the paper's appendix A.2."""
    t = turbidity
    from_zenith = math.pi / 2 - elevation
    sun = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    powers = np.array([from_zenith**3, from_zenith**2, from_zenith, 1.0])
    haze = np.array([t * t, t, 1.0])
    zenith_x = haze @ _ZENITH_X @ powers
    zenith_y = haze @ _ZENITH_Y @ powers
    chi = (4 / 9 - t / 120) * (math.pi - 2 * from_zenith)
    zenith = (4.0453 * t - 4.9710) * math.tan(chi) - 0.2155 * t + 2.4192
    cosine = np.maximum(direction[:, 2], 0.01)
    gamma = np.arccos(np.clip(direction @ sun, -1.0, 1.0))
    luminance, x, y = (
        value
        * _perez(slope * t + offset, cosine, gamma)
        / _perez(slope * t + offset, np.ones(1), np.array(from_zenith))
        for value, (slope, offset) in zip((max(zenith, 0.0), zenith_x, zenith_y), _PEREZ, strict=True)
    )
    return linear_srgb(x, y, KILOCANDELAS * luminance)


def _perez(coefficients: Array, cosine: Array, gamma: Array) -> Array:
    """Distribution of Perez, Seals and Michalsky, "All-weather model for sky luminance distribution", 1993."""
    a, b, c, d, e = coefficients
    distribution: Array = (1 + a * np.exp(b / cosine)) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)
    return distribution


_ZENITH_X = np.array(
    [
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ]
)
_ZENITH_Y = np.array(
    [
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ]
)
_PEREZ = (
    (np.array([0.1787, -0.3554, -0.0227, 0.1206, -0.0670]), np.array([-1.4630, 0.4275, 5.3251, -2.5771, 0.3703])),
    (np.array([-0.0193, -0.0665, -0.0004, -0.0641, -0.0033]), np.array([-0.2592, 0.0008, 0.2125, -0.8989, 0.0452])),
    (np.array([-0.0167, -0.0950, -0.0079, -0.0441, -0.0109]), np.array([-0.2608, 0.0092, 0.2102, -1.6537, 0.0529])),
)


def even_hemisphere(count: int = 512) -> Array:
    """(N, 3) directions above the horizon, dense as the cosine, so that the mean of radiance is irradiance / pi."""
    index = np.arange(count)
    radius, angle = np.sqrt((index + 0.5) / count), index * math.pi * (3 - math.sqrt(5))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)], axis=1)
