"""Tables of the directional albedo of the GGX microfacet model: the share of even light a rough surface mirrors."""

import functools

import numpy as np
import numpy.typing as npt

ALBEDO_STEPS = 16
FACETS = 1024


@functools.cache
def albedo_table() -> npt.NDArray[np.float32]:
    """(16 * 16 * 2,): factors a and b of a * specular + b, by roughness and then by the root of the viewing cosine.

    One bounce between facets, Smith's height-correlated shadowing, Schlick's Fresnel term, as glTF 2.0 has it
    (appendix B). Integrated over visible normals: Heitz, "Sampling the GGX distribution of visible normals", 2018.
    """
    steps = np.linspace(0.0, 1.0, ALBEDO_STEPS)
    alpha = np.maximum(steps[:, None, None] ** 2, 1e-4)
    cosine = np.maximum(steps[None, :, None] ** 2, 1e-3)
    index = np.arange(FACETS)
    radius, angle = np.sqrt((index + 0.5) / FACETS), 2 * np.pi * (index * 0.6180339887498949 % 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    stretched = np.sqrt((alpha * sine) ** 2 + cosine**2)
    view_x, view_z = alpha * sine / stretched, cosine / stretched
    across, along = radius * np.cos(angle), radius * np.sin(angle)
    half = 0.5 * (1.0 + view_z)
    along = (1.0 - half) * np.sqrt(np.maximum(1.0 - across**2, 0.0)) + half * along
    height = np.sqrt(np.maximum(1.0 - across**2 - along**2, 0.0))
    facet = np.stack(
        [
            alpha * (height * view_x - along * view_z),
            alpha * across * np.ones_like(height),
            np.maximum(along * view_x + height * view_z, 1e-9),
        ],
        axis=-1,
    )
    facet /= np.linalg.norm(facet, axis=-1, keepdims=True)
    incidence = facet[..., 0] * sine + facet[..., 2] * cosine
    leaving = 2.0 * incidence * facet[..., 2] - cosine
    shadowing = (1.0 + _slope(alpha, cosine)) / (
        1.0 + _slope(alpha, cosine) + _slope(alpha, np.clip(leaving, 1e-3, 1.0))
    )
    passed = np.where(leaving > 0, shadowing, 0.0)
    fresnel = (1.0 - np.clip(incidence, 0.0, 1.0)) ** 5
    table = np.stack([(passed * (1.0 - fresnel)).mean(axis=-1), (passed * fresnel).mean(axis=-1)], axis=-1)
    return table.astype(np.float32).ravel()


def _slope(alpha: npt.NDArray[np.float64], cosine: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Smith's auxiliary function of the GGX distribution."""
    root: npt.NDArray[np.float64] = 0.5 * (np.sqrt(1.0 + alpha**2 * (1.0 / cosine**2 - 1.0)) - 1.0)
    return root
