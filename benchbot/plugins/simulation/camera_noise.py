"""The noise of a camera's sensor: shot noise and read noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

WHITE = 255
SATURATING = 9.0  # exposed radiance, 5.6 stops above middle grey


class Response(Protocol):
    """The way of a camera from light to bytes, and back: radiance is exposed so that 0.18 is middle grey."""

    def exposed(self, rgb: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return the radiance (H, W, 3) that is shown as these sRGB bytes."""
        ...

    def developed(self, radiance: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
        """Return the sRGB bytes of radiance (H, W, 3), of which none is negative."""
        ...


class SrgbResponse:
    """A camera without a tone curve: the transfer function of sRGB alone (IEC 61966-2-1)."""

    def exposed(self, rgb: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
        """Return linear sRGB, 0 … 1."""
        values = np.arange(256) / 255.0
        linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
        return linear.astype(np.float32)[rgb]

    def developed(self, radiance: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
        """Return the bytes of linear sRGB; what is brighter than white is white."""
        linear = np.minimum(radiance, 1.0)
        encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        return np.round(encoded * 255).astype(np.uint8)


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

    def apply(
        self, rgb: npt.NDArray[np.uint8], random: np.random.Generator, response: Response
    ) -> npt.NDArray[np.uint8]:
        """Return the picture (H, W, 3) with noise.

        Bytes go back through the camera's response to linear light, where the noise is, and forth again. What is white
        stays so: its photosites are full.
        """
        per_electron = SATURATING / self.saturation_electrons
        electrons = random.poisson(response.exposed(rgb) / per_electron) + np.float32(
            self.read_electrons
        ) * random.standard_normal(rgb.shape, np.float32)
        radiance = np.maximum(electrons * per_electron, 0.0).astype(np.float32)
        return np.where(rgb == WHITE, rgb, response.developed(radiance))
