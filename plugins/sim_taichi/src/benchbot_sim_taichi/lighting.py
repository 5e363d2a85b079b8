"""Sun, sky and exposure of an environment, as declared in its YAML."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from benchbot.core.errors import BenchbotError, did_you_mean

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


@dataclass(frozen=True)
class Lighting:
    """Everything that lights a scene besides its own lamps. `exposure` None: chosen from the scene's mean radiance."""

    sun: Sun = field(default_factory=Sun)
    sky: Sky = field(default_factory=Sky)
    exposure: float | None = None

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any] | None) -> "Lighting":
        """Read an environment's `lighting` mapping; absent keys are a clear day. Raises `BenchbotError`."""
        given = _mapping("lighting", mapping, [entry.name for entry in fields(cls)])
        sun = _mapping("lighting.sun", given.get("sun"), [entry.name for entry in fields(Sun)])
        sky = _mapping("lighting.sky", given.get("sky"), [entry.name for entry in fields(Sky)])
        exposure = given.get("exposure")
        return cls(
            sun=Sun(
                azimuth_deg=_number("lighting.sun.azimuth_deg", sun.get("azimuth_deg", Sun.azimuth_deg)),
                elevation_deg=_number("lighting.sun.elevation_deg", sun.get("elevation_deg", Sun.elevation_deg)),
                irradiance=_rgb("lighting.sun.irradiance", sun.get("irradiance", Sun.irradiance)),
            ),
            sky=Sky(
                zenith=_rgb("lighting.sky.zenith", sky.get("zenith", Sky.zenith)),
                horizon=_rgb("lighting.sky.horizon", sky.get("horizon", Sky.horizon)),
                ground=_rgb("lighting.sky.ground", sky.get("ground", Sky.ground)),
            ),
            exposure=None if exposure is None else _positive("lighting.exposure", exposure),
        )


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
