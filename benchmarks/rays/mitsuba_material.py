# mypy: ignore-errors
"""The material of glTF 2.0 (appendix B of its specification) for Mitsuba 3: a matt lobe below a GGX one.

Written for Mitsuba's own interface and from the specification; only what our matt lobe keeps of the light that the
glossy one lets through comes from our table.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_sim_taichi.reflectance import ALBEDO_STEPS, albedo_table

LEAST_ROUGHNESS = 0.03
DIELECTRIC = 0.04
REGISTERED = []


def describe(material: Material, scene: SceneGeometry) -> dict[str, Any]:
    """Mitsuba's description of one of our materials."""
    _register()
    described = {
        "type": "gltf",
        "color": _color(material, scene),
        "rough": _data(scene, material.metallic_roughness_image, 1, material.roughness),
        "metal": _data(scene, material.metallic_roughness_image, 2, material.metallic),
    }
    if material.normal_image is None:
        return described
    bent = _linear(scene.images[material.normal_image])
    bent[..., :2] = (bent[..., :2] - 0.5) * material.normal_scale + 0.5
    return {"type": "normalmap", "normalmap": _texture(bent), "bsdf": described}


def _color(material, scene):
    factor = np.array(material.base_color, np.float32)
    if material.base_color_image is None:
        return {"type": "rgb", "value": factor.tolist()}
    coded = _linear(scene.images[material.base_color_image])
    # The transfer function of sRGB (IEC 61966-2-1).
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    return _texture(linear * factor)


def _data(scene, image, channel, factor):
    if image is None:
        return {"type": "rgb", "value": [float(factor)] * 3}
    return _texture(np.repeat(_linear(scene.images[image])[..., channel, None] * factor, 3, axis=2))


def _linear(image):
    return image[..., :3].astype(np.float32) / 255


def _texture(values):
    upright = np.ascontiguousarray(values, np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(upright), "raw": True, "wrap_mode": "repeat"}


def _register():
    if REGISTERED:
        return
    REGISTERED.append("gltf")

    class Gltf(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)
            self.color, self.rough, self.metal = (props.get_texture(name) for name in ("color", "rough", "metal"))
            both = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide
            lobes = (mi.BSDFFlags.DiffuseReflection | both, mi.BSDFFlags.GlossyReflection | both)
            self.m_components = [int(lobe) for lobe in lobes]
            self.m_flags = self.m_components[0] | self.m_components[1]
            self.albedo = mi.Float(albedo_table())

        def _lobes(self, si, cosine, active):
            color = self.color.eval(si, active)
            metal = self.metal.eval(si, active)[0]
            rough = dr.clip(self.rough.eval(si, active)[0], LEAST_ROUGHNESS, 1)
            specular = DIELECTRIC * (1 - metal) + color * metal
            row, column = rough * (ALBEDO_STEPS - 1), dr.sqrt(dr.clip(cosine, 0, 1)) * (ALBEDO_STEPS - 1)
            low_row = dr.minimum(mi.UInt32(row), ALBEDO_STEPS - 2)
            low_column = dr.minimum(mi.UInt32(column), ALBEDO_STEPS - 2)
            down, right = row - mi.Float(low_row), column - mi.Float(low_column)
            factors = []
            for k in range(2):
                corner = [
                    dr.gather(mi.Float, self.albedo, ((low_row + i) * ALBEDO_STEPS + low_column + j) * 2 + k, active)
                    for i in range(2)
                    for j in range(2)
                ]
                factors.append(
                    dr.lerp(dr.lerp(corner[0], corner[1], right), dr.lerp(corner[2], corner[3], right), down)
                )
            shiny = specular * factors[0] + factors[1]
            matt = color * (1 - metal) * (1 - shiny)
            gloss = dr.max(shiny) / dr.maximum(dr.max(shiny) + dr.max(matt), 1e-6)
            return matt, specular, rough * rough, gloss

        def _value(self, wi, wo, lobes):
            matt, specular, alpha, gloss = lobes
            half = dr.normalize(wi + wo)
            facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, sample_visible=True)
            slope_in = self._slope(alpha, wi.z)
            shadowing = dr.rcp(1 + slope_in + self._slope(alpha, wo.z))
            fresnel = specular + (1 - specular) * (1 - dr.clip(dr.dot(wi, half), 0, 1)) ** 5
            mirrored = fresnel * (facets.eval(half) * shadowing / (4 * wi.z))
            cosine_density = wo.z * dr.inv_pi
            density = gloss * facets.pdf(wi, half) / (4 * dr.dot(wo, half)) + (1 - gloss) * cosine_density
            return mirrored + matt * cosine_density, density

        def _slope(self, alpha, cosine):
            return 0.5 * (dr.sqrt(1 + alpha * alpha * (1 / dr.square(cosine) - 1)) - 1)

        def sample(self, ctx, si, sample1, sample2, active):
            side = dr.sign(si.wi.z)
            wi = mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side)
            active = active & (wi.z > 1e-4)
            lobes = self._lobes(si, wi.z, active)
            facets = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, lobes[2], sample_visible=True)
            facet, _ = facets.sample(wi, sample2)
            glossy = sample1 < lobes[3]
            wo = dr.select(glossy, mi.reflect(wi, facet), mi.warp.square_to_cosine_hemisphere(sample2))
            active &= wo.z > 1e-4
            value, density = self._value(wi, wo, lobes)
            sampled = mi.BSDFSample3f()
            sampled.wo = mi.Vector3f(wo.x, wo.y, wo.z * side)
            sampled.pdf = dr.select(active, density, 0)
            sampled.eta = 1.0
            sampled.sampled_type = dr.select(glossy, mi.UInt32(self.m_components[1]), mi.UInt32(self.m_components[0]))
            sampled.sampled_component = dr.select(glossy, mi.UInt32(1), mi.UInt32(0))
            active &= density > 0
            return sampled, dr.select(active, value / density, 0)

        def eval_pdf(self, ctx, si, wo, active=True):
            side = dr.sign(si.wi.z)
            wi, wo = mi.Vector3f(si.wi.x, si.wi.y, si.wi.z * side), mi.Vector3f(wo.x, wo.y, wo.z * side)
            active = mi.Bool(active) & (wi.z > 1e-4) & (wo.z > 1e-4)
            value, density = self._value(wi, wo, self._lobes(si, wi.z, active))
            return dr.select(active, value, 0), dr.select(active, density, 0)

        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def traverse(self, callback):
            pass

    mi.register_bsdf("gltf", Gltf)
