"""Sun, sky, lamps and exposure of an environment, as declared in its YAML."""

import datetime as dt
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, did_you_mean
from benchbot_sim_taichi.colorimetry import COOLEST_K, HOTTEST_K
from benchbot_sim_taichi.daylight import Daylight
from benchbot_sim_taichi.lamps import Lamps

CLOCK = re.compile(r"([01]\d|2[0-3]):([0-5]\d)")
TIME_KEYS = ("time", "date", "latitude_deg", "north_deg", "turbidity")
KEYS = [*TIME_KEYS, "sun", "sky", "lamps", "exterior", "exposure"]
EXTERIORS = ["town", "trees", "field", "none"]
USUAL_EXTERIOR = "field"
MIDSUMMER = "2023-06-21"
MIDDLE_LATITUDE_DEG = 45.0

Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Sun:
    """Direction towards the sun (azimuth CCW from +x, map frame); irradiance on a plane facing it, linear sRGB."""

    azimuth_deg: float = 215.0
    elevation_deg: float = 35.0
    irradiance: Rgb = (10.0, 9.0, 7.6)

    @property
    def direction(self) -> tuple[float, float, float]:
        """Unit vector towards the sun in the map frame."""
        azimuth, elevation = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        return (
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        )


@dataclass(frozen=True)
class Sky:
    """Radiance by elevation, linear sRGB: `zenith`, `horizon`, and `ground` below the horizon."""

    zenith: Rgb = (0.5, 0.75, 1.2)
    horizon: Rgb = (1.0, 1.1, 1.25)
    ground: Rgb = (0.35, 0.33, 0.3)

    def sky_radiance(self, direction: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """(N, 3) radiance along (N, 3) unit directions; the ground below the horizon."""
        height = np.sqrt(np.clip(direction[:, 2:], 0.0, 1.0))
        above = np.array(self.horizon) + (np.array(self.zenith) - np.array(self.horizon)) * height
        return np.where(direction[:, 2:] < 0, self.ground_radiance(), above)

    def ground_radiance(self) -> npt.NDArray[np.float64]:
        """(3,) as declared."""
        return np.array(self.ground)


@dataclass(frozen=True)
class Exterior:
    """The surroundings, far away: `town`, `trees`, `field`, or `none` for bare ground and sky; `seed` gives another."""

    kind: str = "none"
    seed: int = 0


@dataclass(frozen=True)
class Lighting:
    """Everything that lights a scene, its own lamps included. `exposure` None: chosen from the scene's radiance."""

    sun: Sun = field(default_factory=Sun)
    sky: Sky | Daylight = field(default_factory=Sky)
    exposure: float | None = None
    lamps: Lamps = field(default_factory=Lamps)
    exterior: Exterior = field(default_factory=Exterior)

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any] | None) -> "Lighting":
        """Read an environment's `lighting` mapping; absent keys are a clear day. Raises `BenchbotError`."""
        given = _mapping("lighting", mapping, KEYS)
        sun, sky = _by_time(given) if "time" in given else _by_hand(given)
        exposure = given.get("exposure")
        return cls(
            sun=sun,
            sky=sky,
            exposure=None if exposure is None else _positive("lighting.exposure", exposure),
            lamps=_lamps(given.get("lamps")),
            exterior=_exterior(given.get("exterior")),
        )


def _by_hand(given: Mapping[str, Any]) -> tuple[Sun, Sky]:
    for key in TIME_KEYS:
        if key in given:
            raise BenchbotError(
                f"lighting.{key} says nothing without lighting.time",
                "Sun and sky follow date and place only where a time of day is declared.",
                'Add a time, such as time: "15:30", or remove the key.',
            )
    sun = _mapping("lighting.sun", given.get("sun"), [entry.name for entry in fields(Sun)])
    sky = _mapping("lighting.sky", given.get("sky"), [entry.name for entry in fields(Sky)])
    return (
        Sun(
            azimuth_deg=_number("lighting.sun.azimuth_deg", sun.get("azimuth_deg", Sun.azimuth_deg)),
            elevation_deg=_number("lighting.sun.elevation_deg", sun.get("elevation_deg", Sun.elevation_deg)),
            irradiance=_rgb("lighting.sun.irradiance", sun.get("irradiance", Sun.irradiance)),
        ),
        Sky(
            zenith=_rgb("lighting.sky.zenith", sky.get("zenith", Sky.zenith)),
            horizon=_rgb("lighting.sky.horizon", sky.get("horizon", Sky.horizon)),
            ground=_rgb("lighting.sky.ground", sky.get("ground", Sky.ground)),
        ),
    )


def _by_time(given: Mapping[str, Any]) -> tuple[Sun, Daylight]:
    for key in ("sun", "sky"):
        if key in given:
            raise BenchbotError(
                f"lighting.{key} contradicts lighting.time",
                "At a time of day, sun and sky follow from date and latitude.",
                f"Remove either lighting.time or lighting.{key}.",
            )
    daylight = Daylight(
        time_h=_clock("lighting.time", given["time"]),
        day=_date("lighting.date", given.get("date", MIDSUMMER)),
        latitude_deg=_within("lighting.latitude_deg", given.get("latitude_deg", MIDDLE_LATITUDE_DEG), -90.0, 90.0),
        north_deg=_number("lighting.north_deg", given.get("north_deg", Daylight.north_deg)),
        turbidity=_within("lighting.turbidity", given.get("turbidity", Daylight.turbidity), 2.0, 10.0),
    )
    azimuth_deg, elevation_deg = daylight.sun_angles_deg()
    return Sun(azimuth_deg, elevation_deg, daylight.sun_irradiance()), daylight


def _lamps(value: Any) -> Lamps:
    given = _mapping("lighting.lamps", value, [entry.name for entry in fields(Lamps)])
    on = given.get("on", "all")
    is_list = isinstance(on, list | tuple) and all(isinstance(name, str) for name in on)
    if on not in ("all", "none") and not is_list:
        raise BenchbotError(
            "lighting.lamps.on is neither all nor none nor a list of names",
            f"It is {on!r}.",
            "Write 'all', 'none', or the names of lamps: [ceiling_lamp, desk_lamp].",
        )
    temperature = given.get("temperature_k")
    scale = _number("lighting.lamps.scale", given.get("scale", Lamps.scale))
    if scale < 0:
        raise BenchbotError("lighting.lamps.scale is negative", f"It is {scale!r}.", "Write a number of at least 0.")
    return Lamps(
        on=None if on == "all" else () if on == "none" else tuple(on),
        temperature_k=None
        if temperature is None
        else _within("lighting.lamps.temperature_k", temperature, COOLEST_K, HOTTEST_K),
        scale=scale,
    )


def _exterior(value: Any) -> Exterior:
    given = _mapping("lighting.exterior", value, [entry.name for entry in fields(Exterior)])
    kind, seed = given.get("kind", USUAL_EXTERIOR), given.get("seed", Exterior.seed)
    if kind not in EXTERIORS:
        raise BenchbotError(
            "lighting.exterior.kind is not known",
            f"It is {kind!r}; there are {', '.join(EXTERIORS)}.",
            f"Write one of them.{did_you_mean(str(kind), EXTERIORS)}",
        )
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise BenchbotError(
            "lighting.exterior.seed is no seed", f"It is {seed!r}.", "Write a whole number of at least 0."
        )
    return Exterior(kind, seed)


def _clock(where: str, value: Any) -> float:
    match = CLOCK.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        raise BenchbotError(
            f"{where} is not a time of day",
            f"It is {value!r}; YAML takes 21:30 without quotes for a number.",
            'Write hours and minutes in quotes, such as "21:30".',
        )
    return int(match[1]) + int(match[2]) / 60


def _date(where: str, value: Any) -> int:
    try:
        day = dt.date.fromisoformat(str(value))
    except ValueError as error:
        raise BenchbotError(
            f"{where} is not a date", f"It is {value!r}: {error}.", 'Write year, month and day, such as "2023-06-21".'
        ) from error
    return day.timetuple().tm_yday


def _within(where: str, value: Any, low: float, high: float) -> float:
    number = _number(where, value)
    if not low <= number <= high:
        raise BenchbotError(
            f"{where} is out of range", f"It is {value!r}.", f"Write a number from {low:g} to {high:g}."
        )
    return number


def _mapping(where: str, value: Any, allowed: list[str]) -> Mapping[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise BenchbotError(
            f"{where} is not a mapping",
            f"It is {value!r}.",
            f"Write a mapping with any of: {', '.join(allowed)}.",
        )
    for key in value:
        if key not in allowed:
            raise BenchbotError(
                f"{where} has an unknown key {key!r}",
                f"Known keys are: {', '.join(allowed)}.",
                f"Remove or rename it.{did_you_mean(str(key), allowed)}",
            )
    return value


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BenchbotError(f"{where} is not a number", f"It is {value!r}.", "Write a finite number.")
    return float(value)


def _positive(where: str, value: Any) -> float:
    number = _number(where, value)
    if number <= 0:
        raise BenchbotError(f"{where} is not positive", f"It is {value!r}.", "Write a number above 0.")
    return number


def _rgb(where: str, value: Any) -> Rgb:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise BenchbotError(f"{where} is not a colour", f"It is {value!r}.", "Write three numbers: [r, g, b].")
    red, green, blue = (_number(f"{where}[{i}]", channel) for i, channel in enumerate(value))
    if min(red, green, blue) < 0:
        raise BenchbotError(f"{where} is negative", f"It is {value!r}.", "Write numbers of at least 0.")
    return (red, green, blue)
