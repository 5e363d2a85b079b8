# mypy: ignore-errors
"""The surface at a hit: normals, texture, reflectance."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import negated
from benchbot_sim_taichi.kernels.traversal import vec3
from benchbot_sim_taichi.tables import MATERIAL_STRIDE, TRIANGLE_STRIDE
from benchbot_sim_taichi.textures import FILTER_WIDTH, IMAGE_STRIDE

GRAZING = 0.6
"""Cosine to the viewer below which a pixel is so long on a surface that images are sampled `POINTS` times along it."""
LEAST_FACING = 0.05
POINTS = 4


@ti.dataclass
class Surface:
    """A hit; all normals face the viewer: `normal` with the normal map, `smooth` without, `face` the triangle's.

    Glass has its tint in `diffuse`, one face's reflectance in `specular`; `refraction` is the ratio of refractive
    indices, before the surface over behind it, and 0 for a thin pane.
    """

    normal: vec3
    smooth: vec3
    face: vec3
    diffuse: vec3
    specular: vec3
    emission: vec3
    roughness: ti.f32
    refraction: ti.f32
    is_glass: ti.i32
    is_cut: ti.i32
    instance: ti.i32


@ti.func
def load3(array: ti.template(), at):
    """Three consecutive values."""
    return vec3(array[at], array[at + 1], array[at + 2])


@ti.func
def instance_of(triangles: ti.template(), triangle):
    """The object that a triangle is part of."""
    return ti.cast(triangles[triangle * TRIANGLE_STRIDE + 19], ti.i32)


@ti.func
def texel(texels: ti.template(), at):
    """Unpack ten-bit red, green, blue and two-bit alpha."""
    bits = ti.cast(texels[at], ti.u32)
    return ti.Vector(
        [
            ti.cast(bits & 1023, ti.f32) / 1023.0,
            ti.cast((bits >> 10) & 1023, ti.f32) / 1023.0,
            ti.cast((bits >> 20) & 1023, ti.f32) / 1023.0,
            ti.cast(bits >> 30, ti.f32) / 3.0,
        ]
    )


@ti.func
def wrap(index, size):
    """Repeat an image whose edge is overstepped by one: a division takes longer than all else in a look-up."""
    return ti.select(index < 0, index + size, ti.select(index >= size, index - size, index))


@ti.func
def sample_image(texels: ti.template(), images: ti.template(), image, u, v, footprint_uv):
    """Trilinear, repeating; `footprint_uv` is the width of a pixel in uv. Values as stored (colour: square roots)."""
    start = images[image * IMAGE_STRIDE]
    width = images[image * IMAGE_STRIDE + 1]
    height = images[image * IMAGE_STRIDE + 2]
    levels = images[image * IMAGE_STRIDE + 3]
    widest = FILTER_WIDTH * ti.cast(ti.max(width, height), ti.f32)
    # Level and blend are the exponent and mantissa of the footprint in texels: close to its logarithm, and cheap.
    bits = ti.bit_cast(ti.math.clamp(footprint_uv * widest, 1.0, 1e9), ti.i32)
    level = (bits >> 23) - 127
    blend = ti.bit_cast((bits & 0x7FFFFF) | 0x3F800000, ti.f32) - 1.0
    if level >= levels - 1:
        level = levels - 1
        blend = 0.0
    for _ in range(level):
        start += width * height
        width = ti.max((width + 1) >> 1, 1)
        height = ti.max((height + 1) >> 1, 1)
    total = ti.Vector([0.0, 0.0, 0.0, 0.0])
    repeats = ti.select(blend > 0.02, 2, 1)
    weight = ti.select(blend > 0.02, 1.0 - blend, 1.0)
    for _ in range(repeats):
        x = (u - ti.floor(u)) * ti.cast(width, ti.f32) - 0.5
        y = (v - ti.floor(v)) * ti.cast(height, ti.f32) - 0.5
        x_floor = ti.floor(x)
        y_floor = ti.floor(y)
        fx = x - x_floor
        fy = y - y_floor
        x0 = wrap(ti.cast(x_floor, ti.i32), width)
        y0 = wrap(ti.cast(y_floor, ti.i32), height)
        x1 = wrap(x0 + 1, width)
        y1 = wrap(y0 + 1, height)
        row0 = start + y0 * width
        row1 = start + y1 * width
        top = texel(texels, row0 + x0) * (1.0 - fx) + texel(texels, row0 + x1) * fx
        bottom = texel(texels, row1 + x0) * (1.0 - fx) + texel(texels, row1 + x1) * fx
        total += (top * (1.0 - fy) + bottom * fy) * weight
        start += width * height
        width = ti.max((width + 1) >> 1, 1)
        height = ti.max((height + 1) >> 1, 1)
        weight = blend
    return total


@ti.func
def surface_at(
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    triangle,
    u,
    v,
    direction,
    footprint_m,
):
    """Interpolate and texture a hit seen along unit `direction`; `footprint_m` is the width of the ray there.

    A ray at a cosine c to a surface covers 1/c times its width along it, and once across. Images are filtered by the
    geometric mean of the two; where the surface is `GRAZING`, by several points along it of a part of the length each.
    """
    base = triangle * TRIANGLE_STRIDE
    w = 1.0 - u - v
    face = load3(triangles, base + 15)
    normal = load3(triangles, base) * w + load3(triangles, base + 3) * u + load3(triangles, base + 6) * v
    length = normal.norm()
    normal = ti.select(length > 1e-6, normal / ti.max(length, 1e-6), face)
    is_front = face.dot(direction) <= 0.0
    if not is_front:
        face = negated(face)
    if normal.dot(face) < 0.0:
        normal = negated(normal)
    smooth = normal

    row = ti.cast(triangles[base + 18], ti.i32) * MATERIAL_STRIDE
    color = load3(materials, row)
    roughness = materials[row + 7]
    metallic = materials[row + 6]
    emission = load3(materials, row + 3)
    alpha = 1.0
    color_image = ti.cast(materials[row + 8], ti.i32)
    rough_image = ti.cast(materials[row + 9], ti.i32)
    normal_image = ti.cast(materials[row + 10], ti.i32)
    glow_image = ti.cast(materials[row + 15], ti.i32)
    if color_image >= 0 or rough_image >= 0 or normal_image >= 0 or glow_image >= 0:
        tu = triangles[base + 9] * w + triangles[base + 11] * u + triangles[base + 13] * v
        tv = triangles[base + 10] * w + triangles[base + 12] * u + triangles[base + 14] * v
        density = triangles[base + 20]
        facing = ti.max(-face.dot(direction), LEAST_FACING)
        width_uv = footprint_m * ti.abs(density)
        footprint = width_uv / ti.sqrt(facing)
        points = 1
        step_u, step_v = 0.0, 0.0
        if facing < GRAZING:
            points = POINTS
            step_uv = width_uv / (facing * POINTS)
            footprint = ti.max(width_uv, step_uv)
            tangent = load3(triangles, base + 21)
            bitangent = load3(triangles, base + 15).cross(tangent) * ti.select(density < 0.0, 1.0, -1.0)
            step_u = step_uv * direction.dot(tangent)
            step_v = step_uv * direction.dot(bitangent)
        for k in range(4):  # one call site: the sampler is large, and every call is compiled anew
            image = ti.select(
                k == 0, color_image, ti.select(k == 1, rough_image, ti.select(k == 2, normal_image, glow_image))
            )
            if image >= 0:
                value = ti.Vector([0.0, 0.0, 0.0, 0.0])
                for point in range(points):
                    at = ti.cast(point, ti.f32) - 0.5 * ti.cast(points - 1, ti.f32)
                    value += sample_image(texels, images, image, tu + step_u * at, tv + step_v * at, footprint)
                value /= ti.cast(points, ti.f32)
                if k == 0:
                    color *= vec3(value.x * value.x, value.y * value.y, value.z * value.z)
                    alpha = value.w
                elif k == 1:
                    roughness *= value.y
                    metallic *= value.z
                elif k == 3:
                    emission *= vec3(value.x * value.x, value.y * value.y, value.z * value.z)
                else:
                    scale = materials[row + 11]
                    tangent = load3(triangles, base + 21)
                    tangent = (tangent - normal * normal.dot(tangent)).normalized(1e-9)
                    bitangent = normal.cross(tangent) * ti.select(density < 0.0, -1.0, 1.0)
                    bent = (
                        tangent * ((value.x * 2.0 - 1.0) * scale)
                        + bitangent * ((value.y * 2.0 - 1.0) * scale)
                        + normal * ti.max(value.z * 2.0 - 1.0, 0.1)
                    ).normalized(1e-9)
                    normal = ti.select(bent.dot(direction) < -0.02, bent, normal)
    cutoff = materials[row + 13]
    is_glass = materials[row + 12] > 0.5
    index = materials[row + 17]
    return Surface(
        normal=normal,
        smooth=smooth,
        face=face,
        diffuse=ti.select(is_glass, color, color * (1.0 - metallic)),
        specular=vec3(materials[row + 16]) * (1.0 - metallic) + color * metallic,
        emission=emission,
        roughness=ti.math.clamp(roughness, 0.03, 1.0),
        refraction=ti.select(index > 0.0, ti.select(is_front, 1.0 / ti.max(index, 1.0), index), 0.0),
        is_glass=ti.cast(is_glass, ti.i32),
        is_cut=ti.cast(alpha < cutoff, ti.i32),
        instance=ti.cast(triangles[base + 19], ti.i32),
    )
