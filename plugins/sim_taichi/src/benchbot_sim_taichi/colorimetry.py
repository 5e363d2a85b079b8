"""Colours of light: chromaticities, the Planckian locus, and their linear sRGB."""

import numpy as np
import numpy.typing as npt

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # of linear sRGB (ITU-R BT.709)
COOLEST_K, HOTTEST_K = 1667.0, 25000.0
_XYZ_TO_SRGB = np.array(  # IEC 61966-2-1
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)


def linear_srgb(
    x: npt.NDArray[np.float64] | float, y: npt.NDArray[np.float64] | float, luminance: npt.NDArray[np.float64] | float
) -> npt.NDArray[np.float64]:
    """(…, 3) linear sRGB of CIE 1931 chromaticities and luminances; what the primaries cannot mix is clipped."""
    x, y, luminance = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float), np.asarray(luminance, float))
    xyz = np.stack([x / y * luminance, luminance, (1.0 - x - y) / y * luminance], axis=-1)
    clipped: npt.NDArray[np.float64] = np.maximum(xyz @ _XYZ_TO_SRGB.T, 0.0)
    return clipped


def planckian(temperature_k: float) -> npt.NDArray[np.float64]:
    """(3,) linear sRGB of a glowing black body, of luminance 1.

    Cubic fits of the Planckian locus, 1667 K to 25000 K: Kim et al., "Design of advanced color temperature control
    system for HDTV applications", Journal of the Korean Physical Society 41 (2002).
    """
    t = 1e3 / temperature_k
    if temperature_k < 4000.0:
        x = -0.2661239 * t**3 - 0.2343589 * t**2 + 0.8776956 * t + 0.179910
    else:
        x = -3.0258469 * t**3 + 2.1070379 * t**2 + 0.2226347 * t + 0.240390
    if temperature_k < 2222.0:
        y = -1.1063814 * x**3 - 1.34811020 * x**2 + 2.18555832 * x - 0.20219683
    elif temperature_k < 4000.0:
        y = -0.9549476 * x**3 - 1.37418593 * x**2 + 2.09137015 * x - 0.16748867
    else:
        y = 3.0817580 * x**3 - 5.87338670 * x**2 + 3.75112997 * x - 0.37001483
    color = linear_srgb(x, y, 1.0)
    unit: npt.NDArray[np.float64] = color / (LUMINANCE @ color)
    return unit
