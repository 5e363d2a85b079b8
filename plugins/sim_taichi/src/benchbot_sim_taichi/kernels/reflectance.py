# mypy: ignore-errors
"""Scattering of light by surfaces, a matt lobe below a GGX lobe (glTF 2.0, appendix B), and by panes."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.sampling import TWO_PI, orthonormal
from benchbot_sim_taichi.kernels.traversal import vec3
from benchbot_sim_taichi.lights import ALBEDO_AT
from benchbot_sim_taichi.reflectance import ALBEDO_STEPS

INV_PI = 0.31830988618379067
LEAST_COSINE = 1e-3


@ti.func
def environment_brdf(env: ti.template(), specular, roughness, cosine):
    """Share of uniform light that a GGX surface mirrors, from the table of `benchbot_sim_taichi.reflectance`."""
    row = ti.math.clamp(roughness, 0.0, 1.0) * (ALBEDO_STEPS - 1)
    column = ti.sqrt(ti.math.clamp(cosine, 0.0, 1.0)) * (ALBEDO_STEPS - 1)
    row0 = ti.min(ti.cast(row, ti.i32), ALBEDO_STEPS - 2)
    column0 = ti.min(ti.cast(column, ti.i32), ALBEDO_STEPS - 2)
    down = row - ti.cast(row0, ti.f32)
    right = column - ti.cast(column0, ti.f32)
    upper = ALBEDO_AT + (row0 * ALBEDO_STEPS + column0) * 2
    lower = upper + ALBEDO_STEPS * 2
    scale = (env[upper] * (1.0 - right) + env[upper + 2] * right) * (1.0 - down)
    scale += (env[lower] * (1.0 - right) + env[lower + 2] * right) * down
    bias = (env[upper + 1] * (1.0 - right) + env[upper + 3] * right) * (1.0 - down)
    bias += (env[lower + 1] * (1.0 - right) + env[lower + 3] * right) * down
    return specular * scale + bias


@ti.func
def mean_mirrored(env: ti.template(), specular, roughness):
    """Share of uniform light that a GGX surface mirrors into all directions together, from four of them."""
    total = vec3(0.0)
    for k in range(4):
        total += environment_brdf(env, specular, roughness, ti.sqrt((ti.cast(k, ti.f32) + 0.5) / 4.0))
    return total / 4.0


@ti.func
def schlick(specular, cosine):
    """Fresnel reflectance (Schlick, "An inexpensive BRDF model", 1994)."""
    return specular + (vec3(1.0) - specular) * (1.0 - ti.math.clamp(cosine, 0.0, 1.0)) ** 5


@ti.func
def smith(alpha, cosine):
    """Smith's auxiliary function of the GGX distribution."""
    return 0.5 * (ti.sqrt(1.0 + alpha * alpha * (1.0 / (cosine * cosine) - 1.0)) - 1.0)


@ti.func
def facet_density(alpha, normal, half):
    """GGX distribution of microfacets; the sine is worked out by itself, for mirrors are narrower than rounding."""
    sine2 = normal.cross(half).norm_sqr()
    cosine2 = normal.dot(half) ** 2
    a2 = alpha * alpha
    spread = cosine2 * a2 + sine2
    return a2 * INV_PI / ti.max(spread * spread, 1e-20)


@ti.func
def scatter(normal, view, toward, matt, specular, roughness, gloss):
    """Light sent from `toward` to `view`, times the cosine (3), and the density with which `sample` finds it.

    `matt` is the reflectance of the lower lobe, `gloss` the share of samples that the upper one gets.
    """
    n_v = ti.max(normal.dot(view), LEAST_COSINE)
    n_l = normal.dot(toward)
    result = ti.Vector([0.0, 0.0, 0.0, 0.0])
    if n_l > 0.0:
        alpha = roughness * roughness
        half = (view + toward).normalized(1e-12)
        distribution = facet_density(alpha, normal, half)
        from_view = smith(alpha, n_v)
        mirrored = schlick(specular, half.dot(view)) * (
            distribution / (4.0 * n_v * (1.0 + from_view + smith(alpha, ti.max(n_l, LEAST_COSINE))))
        )
        value = mirrored + matt * (INV_PI * n_l)
        density = gloss * distribution / (4.0 * n_v * (1.0 + from_view)) + (1.0 - gloss) * n_l * INV_PI
        result = ti.Vector([value.x, value.y, value.z, density])
    return result


@ti.func
def mirror_direction(normal, view, roughness, xi):
    """Direction mirrored by a visible facet (Heitz, "Sampling the GGX distribution of visible normals", 2018)."""
    alpha = roughness * roughness
    tangent, bitangent = orthonormal(normal)
    local = vec3(
        alpha * tangent.dot(view), alpha * bitangent.dot(view), ti.max(normal.dot(view), LEAST_COSINE)
    ).normalized()
    first, second = orthonormal(local)
    radius = ti.sqrt(xi.x)
    across = radius * ti.cos(TWO_PI * xi.y)
    along = radius * ti.sin(TWO_PI * xi.y)
    # The disc's lower half is hidden from view: squeeze it towards the horizon, which runs across `first`.
    first = ti.select(local.z < 0.99999, vec3(-local.y, local.x, 0.0).normalized(1e-12), first)
    second = local.cross(first)
    half = 0.5 * (1.0 + local.z)
    along = (1.0 - half) * ti.sqrt(ti.max(1.0 - across * across, 0.0)) + half * along
    height = ti.sqrt(ti.max(1.0 - across * across - along * along, 0.0))
    facet = first * across + second * along + local * height
    facet = vec3(alpha * facet.x, alpha * facet.y, ti.max(facet.z, 1e-9)).normalized()
    facet = tangent * facet.x + bitangent * facet.y + normal * facet.z
    return (facet * (2.0 * view.dot(facet)) - view).normalized(1e-12)


@ti.func
def mirror_share(normal, view, toward, specular, roughness):
    """Share of light from `toward`, a `mirror_direction`, that goes to `view`; its mean is `environment_brdf`."""
    result = vec3(0.0)
    if normal.dot(toward) > 0.0:
        alpha = roughness * roughness
        from_view = 1.0 + smith(alpha, ti.max(normal.dot(view), LEAST_COSINE))
        hidden = smith(alpha, ti.max(normal.dot(toward), LEAST_COSINE))
        half = (view + toward).normalized(1e-12)
        result = schlick(specular, half.dot(view)) * (from_view / (from_view + hidden))
    return result


@ti.func
def pane_reflectance(f0, cosine):
    """Share that a thin pane mirrors, both faces together, of one face's reflectance `f0` head-on."""
    single = f0 + (1.0 - f0) * (1.0 - ti.math.clamp(cosine, 0.0, 1.0)) ** 5
    return 2.0 * single / (1.0 + single)


@ti.func
def dielectric_reflectance(cosine, ratio):
    """Fresnel's equations for unpolarised light; `ratio` of refractive indices, before over behind; 1 is total."""
    sine2 = ratio * ratio * (1.0 - cosine * cosine)
    reflectance = 1.0
    if sine2 < 1.0:
        behind = ti.sqrt(1.0 - sine2)
        parallel = (cosine - ratio * behind) / (cosine + ratio * behind)
        perpendicular = (ratio * cosine - behind) / (ratio * cosine + behind)
        reflectance = 0.5 * (parallel * parallel + perpendicular * perpendicular)
    return reflectance
