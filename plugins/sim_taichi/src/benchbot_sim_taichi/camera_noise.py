"""The noise of a camera's sensor: shot noise and read noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from benchbot_sim_taichi import camera_response
from benchbot_sim_taichi.textures import srgb_to_linear

WHITE = 255
SATURATING = 9.0  # exposed radiance, 5.6 stops above middle grey


@dataclass(frozen=True)
class CameraNoise:
    """The camera model of EMVA 1288 (release 4.0, section 2), in electrons.

    `saturation_electrons` are what a photosite holds at 50 times middle grey; a photosite counts a Poisson
    distributed number of them, whose mean is proportional to radiance, plus a normal one of standard deviation
    `read_electrons`. Each of red, green and blue has photosites of its own. What is brighter, up to white, is counted
    on, as if by a second, larger photosite: sensors of wide range have two of them.
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
        per_electron = SATURATING / self.saturation_electrons
        mean = camera_response.exposed(srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)[rgb]) / per_electron
        electrons = random.poisson(mean) + np.float32(self.read_electrons) * random.standard_normal(
            rgb.shape, np.float32
        )
        radiance = np.clip(electrons * per_electron, 0.0, camera_response.BRIGHTEST).astype(np.float32)
        return np.where(rgb == WHITE, rgb, camera_response.srgb_bytes(camera_response.filmic(radiance)))
