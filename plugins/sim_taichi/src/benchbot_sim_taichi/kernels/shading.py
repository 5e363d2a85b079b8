# mypy: ignore-errors
"""From light and reflectance to radiance, and weights that keep it bounded."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.reflectance import INV_PI, environment_brdf
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import vec3

REFLECT_ROUGHNESS = 0.55  # from which on surfaces are dull: no ray is sent for what they mirror
EVER_LESS, LESS_FACING = 0.65, 0.35


@ti.func
def sun_highlight(normal, view, toward, specular, roughness):
    """GGX reflection of the sun, per unit irradiance times cosine; `view` points to the viewer."""
    half = (view + toward).normalized(1e-9)
    nv = ti.max(normal.dot(view), 1e-3)
    nl = ti.max(normal.dot(toward), 1e-3)
    nh = ti.max(normal.dot(half), 0.0)
    alpha = ti.max(roughness * roughness, 0.02)
    a2 = alpha * alpha
    d = nh * nh * (a2 - 1.0) + 1.0
    distribution = a2 * INV_PI / (d * d)
    visibility = 0.5 / (nl * ti.sqrt(nv * nv * (1.0 - a2) + a2) + nv * ti.sqrt(nl * nl * (1.0 - a2) + a2))
    fresnel = specular + (vec3(1.0) - specular) * ti.pow(1.0 - ti.max(half.dot(view), 0.0), 5.0)
    return fresnel * ti.min(distribution * visibility, 50.0)


@ti.func
def mirrored_share(env: ti.template(), direction, normal, surface):
    """Return the share of each colour that a surface mirrors towards a viewer who looks along `direction`."""
    return environment_brdf(env, surface.specular, surface.roughness, ti.max(-normal.dot(direction), 0.0))


@ti.func
def ahead(direction, surface, vector):
    """Return how much brighter than on average it is where a dull surface mirrors a viewer who looks along `direction`.

    Of the light around only irradiance and its `vector` are known. Light that grows evenly along the surface, of the
    same vector, is brighter by four times the vector in the lobe's mean direction; the fourth power of a quarter of
    that has the same slope, is never negative, and lies closer to light from a window. `lean` is the length of the
    lobe's mean direction along the surface, in parts of the view's (GGX with a specular of 0.04: within 0.07).
    """
    cosine = ti.max(-surface.normal.dot(direction), 0.0)
    lean = 1.0 - surface.roughness * (surface.roughness * EVER_LESS + cosine * LESS_FACING)
    root = ti.max(1.0 + lean * vector.dot(direction), 0.0)
    return root * root * root * root


@ti.func
def dull_reflection(direction, surface, stored):
    """Return the radiance (3) around a dull surface, where it mirrors a viewer who looks along `direction`."""
    return stored.irradiance * (ahead(direction, surface, stored.vector) * INV_PI)


@ti.func
def shade(env: ti.template(), direction, surface, irradiance, sun, mirrored, reflection):
    """Radiance that leaves a surface towards the viewer; `reflection` is what it mirrors, but for the sun."""
    toward = load3(env, 0)
    cosine = ti.max(surface.normal.dot(toward), 0.0)
    sunlight = load3(env, 3) * (sun * cosine)
    radiance = surface.emission + mirrored * reflection
    radiance += (irradiance + sunlight) * surface.diffuse * (vec3(1.0) - mirrored) * INV_PI
    if sun * cosine > 0.0:
        view = negated(direction)
        radiance += sunlight * sun_highlight(surface.normal, view, toward, surface.specular, surface.roughness)
    return radiance


@ti.func
def compress(color):
    """Bounded weight of a sample, so that one bright sample does not own an edge pixel (Karis, 2013)."""
    return color / (1.0 + color.max())


@ti.func
def expand(color):
    """Inverse of `compress`."""
    return color / ti.max(1.0 - color.max(), 1e-3)
