"""The noise of a camera's sensor: shot noise and read noise."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi.camera_response import BRIGHTEST, CURVE_STEPS, filmic, srgb_bytes

WHITE = 255


@dataclass(frozen=True)
class CameraNoise:
    """The camera model of EMVA 1288 (release 4.0, section 2), in electrons.

    `saturation_electrons` are what a photosite holds where the picture gets white; a photosite counts a Poisson
    distributed number of them, whose mean is proportional to radiance, plus a normal one of standard deviation
    `read_electrons`. Each of red, green and blue has photosites of its own.
    """

    saturation_electrons: float
    read_electrons: float

    def __post_init__(self) -> None:
        if not (0 < self.saturation_electrons < 1e9 and 0 <= self.read_electrons < np.inf):
            raise ValueError(f"{self} is no noise: saturation_electrons > 0 and read_electrons >= 0 are needed")

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Read a camera's `rgb_noise`; raises TypeError or ValueError when it is not one."""
        return cls(**{str(key): float(value) for key, value in values.items()})

    def apply(self, rgb: npt.NDArray[np.uint8], random: np.random.Generator) -> npt.NDArray[np.uint8]:
        """Return the picture (H, W, 3) with noise.

        Bytes go back through the camera's response to linear light, where the noise is, and forth again. What is white
        stays so: its photosites are full.
        """
        to_bytes, to_radiance = _response()
        per_electron = to_radiance[WHITE] / self.saturation_electrons
        mean = (to_radiance / per_electron)[rgb]
        electrons = random.poisson(mean) + np.float32(self.read_electrons) * random.standard_normal(
            rgb.shape, np.float32
        )
        share = np.clip(electrons * (per_electron / BRIGHTEST), 0.0, 1.0)
        noisy = to_bytes[np.rint(np.sqrt(share) * (CURVE_STEPS - 1)).astype(np.intp)]
        return np.where(rgb == WHITE, rgb, noisy)


@functools.cache
def _response() -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float64]]:
    """Bytes for even steps of the root of radiance up to `BRIGHTEST`, and the radiance (256,) of each byte."""
    radiance = np.linspace(0.0, 1.0, CURVE_STEPS) ** 2 * BRIGHTEST
    to_bytes = srgb_bytes(filmic(radiance.astype(np.float32)))
    first, last = (np.searchsorted(to_bytes, np.arange(256), side) for side in ("left", "right"))
    to_radiance = (radiance[first] + radiance[last - 1]) / 2
    to_radiance[0], to_radiance[WHITE] = 0.0, radiance[first[WHITE]]
    return to_bytes, to_radiance
