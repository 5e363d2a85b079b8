# mypy: ignore-errors
"""From light and reflectance to radiance, and weights that keep it bounded."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.reflectance import INV_PI, environment_brdf
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import vec3

REFLECT_ROUGHNESS = 0.55  # from which on surfaces are dull: no ray is sent for what they mirror
EVER_LESS, LESS_FACING = 0.65, 0.35
LOBE_COSINE, TO_LOBE = 0.57, 0.9
EVEN_COSINE = 2.0 / 3.0  # the mean at which even light comes, by what it lights


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


@ti.dataclass
class Agreement:
    """How far light on a dull surface comes from where its lobe points: products of both mean directions.

    `along` is that along the surface, `most_along2` the square of what it is for the viewer at the same angle who sees
    most, and `up` that of the cosines to the normal, each beyond that of even light. All are 0 in even light.
    """

    along: ti.f32
    most_along2: ti.f32
    up: ti.f32


@ti.func
def agreement(direction, surface, vector):
    """Compare the mean direction of light, `vector`, with that of the lobe for a viewer who looks along `direction`.

    That of the lobe is fitted to GGX with a specular of 0.04: its length along the surface, in parts of the view's,
    within 0.07, and its cosine within 0.04.
    """
    cosine = ti.max(-surface.normal.dot(direction), 0.0)
    lean = 1.0 - surface.roughness * (surface.roughness * EVER_LESS + cosine * LESS_FACING)
    height = cosine + (LOBE_COSINE - cosine) * (surface.roughness * TO_LOBE)
    steep = ti.math.clamp(surface.normal.dot(vector), 0.0, 1.0)
    flat2 = ti.max(vector.norm_sqr() - steep * steep, 0.0)
    return Agreement(
        along=lean * (vector.dot(direction) + steep * cosine),
        most_along2=lean * lean * flat2 * (1.0 - cosine * cosine),
        up=(steep - EVEN_COSINE) * (height - EVEN_COSINE),
    )


@ti.func
def dull_reflection(direction, surface, stored):
    """Return the radiance (3) around a dull surface, where it mirrors a viewer who looks along `direction`.

    Of the light around only irradiance and its vector are known. Light that changes evenly along the surface and with
    the cosine to its normal, and has these, differs from the mean by 4 `along` and 18 `up`. The fourth power of a
    quarter of that has the same slope, is never negative, and lies closer to light from windows and lamps, with half of
    what `up` adds: where it does, `along` adds the same light.
    """
    agrees = agreement(direction, surface, stored.vector)
    up = ti.min(4.5 * agrees.up, 2.25 * agrees.up)
    return stored.irradiance * (ti.max(1.0 + agrees.along + up, 0.0) ** 4 * INV_PI)


@ti.func
def sent_by_dull(direction, surface, stored):
    """Return the same for one of many viewers all around: on average over all turns it is that of the even change.

    Beside windows and lamps the fourth power is larger on average, and rays that gather light would find too much.
    """
    agrees = agreement(direction, surface, stored.vector)
    power = ti.max(1.0 + agrees.along, 0.0) ** 4
    mean = 1.0 + (3.0 + 0.375 * agrees.most_along2) * agrees.most_along2
    return stored.irradiance * (power / mean * ti.max(1.0 + 18.0 * agrees.up, 0.0) * INV_PI)


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
