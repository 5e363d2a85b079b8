# mypy: ignore-errors
"""What sixteen hits show of surfaces, a lane each: the same as `surface`, for processors.

Neighbouring hits mostly share a triangle and nearly always a material: a record is read once for all lanes that it is
for, and lanes without a triangle (-1) take part in nothing.
"""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import (
    LANE_BITS,
    Lanes3,
    absolute,
    bits_of,
    dot3,
    equal_lanes,
    from_bits,
    gather_ints,
    ints16,
    lanes3,
    larger,
    normalized3,
    scaled3,
    select3,
    smaller,
    sum3,
    to_floats,
    to_ints,
    union,
    vec16,
)
from benchbot_sim_taichi.kernels.surface import GRAZING, LEAST_FACING, POINTS, load3
from benchbot_sim_taichi.tables import MATERIAL_STRIDE, TRIANGLE_STRIDE
from benchbot_sim_taichi.textures import FILTER_WIDTH, IMAGE_STRIDE


@ti.dataclass
class LaneSurface:
    """`surface.Surface` of each lane; `is_glass` and `is_cut` are 1 where it is so, `number` is `paint`'s."""

    normal: Lanes3
    smooth: Lanes3
    face: Lanes3
    diffuse: Lanes3
    specular: Lanes3
    emission: Lanes3
    roughness: vec16
    is_glass: ints16
    is_cut: ints16
    is_back: ints16
    instance: vec16
    material: vec16


@ti.dataclass
class LaneTexel:
    """What `surface.sample_image` returns, of each lane."""

    red: vec16
    green: vec16
    blue: vec16
    alpha: vec16


@ti.func
def wrap_lanes(index, size):
    """See `surface.wrap`."""
    return ti.select(index < 0, index + size, ti.select(index >= size, index - size, index))


@ti.func
def sample_lanes(
    texels: ti.template(), images: ti.template(), image, u: ti.template(), v: ti.template(), footprint_uv: ti.template()
):
    """See `surface.sample_image`; the image is that of all lanes."""
    base = image * IMAGE_STRIDE
    start = ints16(images[base])
    width = ints16(images[base + 1])
    height = ints16(images[base + 2])
    last = images[base + 3] - 1
    widest = FILTER_WIDTH * ti.cast(ti.max(images[base + 1], images[base + 2]), ti.f32)
    bits = bits_of(smaller(larger(footprint_uv * widest, vec16(1.0)), vec16(1e9)))
    level = (bits >> 23) - 127
    blend = from_bits((bits & 0x7FFFFF) | 0x3F800000) - 1.0
    blend = ti.select((level >= last) | (blend <= 0.02), vec16(0.0), blend)
    level = ti.select(level >= last, ints16(last), level)
    deepest = 0
    for lane in ti.static(range(16)):
        deepest = ti.max(deepest, level[lane])
    for k in range(deepest):
        start = ti.select(level > k, start + width * height, start)
        width = ti.select((level > k) & (width > 1), (width + 1) >> 1, width)
        height = ti.select((level > k) & (height > 1), (height + 1) >> 1, height)
    found = LaneTexel(red=vec16(0.0), green=vec16(0.0), blue=vec16(0.0), alpha=vec16(0.0))
    u_inside = u - ti.floor(u)
    v_inside = v - ti.floor(v)
    share = 1.0 - blend
    repeats = ti.select(union(ti.select(blend > 0.0, ints16(1), ints16(0))) != 0, 2, 1)
    for _ in range(repeats):
        x = u_inside * to_floats(width) - 0.5
        y = v_inside * to_floats(height) - 0.5
        x_floor = ti.floor(x)
        y_floor = ti.floor(y)
        fx = x - x_floor
        fy = y - y_floor
        x0 = wrap_lanes(to_ints(x_floor), width)
        y0 = wrap_lanes(to_ints(y_floor), height)
        x1 = wrap_lanes(x0 + 1, width)
        row0 = start + y0 * width
        row1 = start + wrap_lanes(y0 + 1, height) * width
        for corner in range(4):
            texel = gather_ints(texels, ti.select(corner > 1, row1, row0) + ti.select(corner % 2 == 1, x1, x0))
            weight = share * ti.select(corner % 2 == 1, fx, 1.0 - fx) * ti.select(corner > 1, fy, 1.0 - fy)
            found.red += to_floats(texel & 1023) * weight
            found.green += to_floats((texel >> 10) & 1023) * weight
            found.blue += to_floats((texel >> 20) & 1023) * weight
            found.alpha += to_floats((texel >> 30) & 3) * weight
        start += width * height
        width = ti.select(width > 1, (width + 1) >> 1, width)
        height = ti.select(height > 1, (height + 1) >> 1, height)
        share = blend
    found.red *= 1.0 / 1023.0
    found.green *= 1.0 / 1023.0
    found.blue *= 1.0 / 1023.0
    found.alpha *= 1.0 / 3.0
    return found


@ti.func
def surfaces_at(
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    triangle: ti.template(),
    u: ti.template(),
    v: ti.template(),
    direction: ti.template(),
    footprint_m: ti.template(),
):
    """See `surface.surface_at`."""
    nothing = lanes3(ti.Vector([0.0, 0.0, 0.0]))
    found = LaneSurface(roughness=vec16(1.0), is_glass=ints16(0), is_cut=ints16(0), is_back=ints16(0))
    found.diffuse, found.specular, found.emission = nothing, nothing, nothing
    found.instance, found.material = vec16(0.0), vec16(-1.0)
    w = 1.0 - u - v
    normal, face, tangent = nothing, nothing, nothing
    tu, tv, density = vec16(0.0), vec16(0.0), vec16(0.0)
    numbers = triangle  # what is indexed at run time lies in memory
    left = union(ti.select(triangle >= 0, ints16(LANE_BITS), ints16(0)))
    there = left
    while left != 0:
        base = numbers[31 - ti.math.clz(left)]
        mine = equal_lanes(triangle, base)
        left &= ~union(mine)
        base *= TRIANGLE_STRIDE
        at_corner = Lanes3(
            x=triangles[base] * w + triangles[base + 3] * u + triangles[base + 6] * v,
            y=triangles[base + 1] * w + triangles[base + 4] * u + triangles[base + 7] * v,
            z=triangles[base + 2] * w + triangles[base + 5] * u + triangles[base + 8] * v,
        )
        normal = select3(mine, at_corner, normal)
        face = select3(mine, lanes3(load3(triangles, base + 15)), face)
        tangent = select3(mine, lanes3(load3(triangles, base + 21)), tangent)
        tu = ti.select(mine != 0, triangles[base + 9] * w + triangles[base + 11] * u + triangles[base + 13] * v, tu)
        tv = ti.select(mine != 0, triangles[base + 10] * w + triangles[base + 12] * u + triangles[base + 14] * v, tv)
        density = ti.select(mine != 0, vec16(triangles[base + 20]), density)
        found.material = ti.select(mine != 0, vec16(triangles[base + 18]), found.material)
        found.instance = ti.select(mine != 0, vec16(triangles[base + 19]), found.instance)
    length = ti.sqrt(dot3(normal, normal))
    normal = select3(
        ti.select(length > 1e-6, ints16(1), ints16(0)), scaled3(normal, 1.0 / larger(length, vec16(1e-6))), face
    )
    facing = dot3(face, direction)
    width_uv = footprint_m * absolute(density)
    steepness = larger(absolute(facing), vec16(LEAST_FACING))
    is_grazing = ti.select((steepness < GRAZING) & (triangle >= 0), ints16(LANE_BITS), ints16(0))
    # Along the surface, from one sampled point of an image to the next: zero where there is only one.
    step_uv = ti.select(is_grazing != 0, width_uv / (steepness * POINTS), vec16(0.0))
    footprint = ti.select(is_grazing != 0, larger(width_uv, step_uv), width_uv / ti.sqrt(steepness))
    turn = ti.select(density < 0.0, vec16(1.0), vec16(-1.0))
    bitangent = Lanes3(
        x=(face.y * tangent.z - face.z * tangent.y) * turn,
        y=(face.z * tangent.x - face.x * tangent.z) * turn,
        z=(face.x * tangent.y - face.y * tangent.x) * turn,
    )
    step_u = step_uv * dot3(direction, tangent)
    step_v = step_uv * dot3(direction, bitangent)
    found.is_back = ti.select(facing > 0.0, ints16(1), ints16(0))
    face = scaled3(face, ti.select(facing > 0.0, vec16(-1.0), vec16(1.0)))
    facing = absolute(facing)
    normal = scaled3(normal, ti.select(dot3(normal, face) < 0.0, vec16(-1.0), vec16(1.0)))
    found.face, found.smooth = face, normal
    found.normal = normal
    materials_of = found.material
    left = there
    while left != 0:
        kind = materials_of[31 - ti.math.clz(left)]
        mine = equal_lanes(found.material, kind)
        left &= ~union(mine)
        row = ti.cast(kind, ti.i32) * MATERIAL_STRIDE
        color = lanes3(load3(materials, row))
        emission = lanes3(load3(materials, row + 3))
        metallic = vec16(materials[row + 6])
        roughness = vec16(materials[row + 7])
        alpha = vec16(1.0)
        color_image = ti.cast(materials[row + 8], ti.i32)
        rough_image = ti.cast(materials[row + 9], ti.i32)
        normal_image = ti.cast(materials[row + 10], ti.i32)
        glow_image = ti.cast(materials[row + 15], ti.i32)
        if color_image >= 0 or rough_image >= 0 or normal_image >= 0 or glow_image >= 0:
            points = ti.select(union(mine & is_grazing) != 0, POINTS, 1)
            for k in range(4):  # one call site: the sampler is large, and every call is compiled anew
                image = ti.select(
                    k == 0, color_image, ti.select(k == 1, rough_image, ti.select(k == 2, normal_image, glow_image))
                )
                if image >= 0:
                    value = LaneTexel(red=vec16(0.0), green=vec16(0.0), blue=vec16(0.0), alpha=vec16(0.0))
                    part = 1.0 / ti.cast(points, ti.f32)
                    for point in range(points):
                        at = ti.cast(point, ti.f32) - 0.5 * ti.cast(points - 1, ti.f32)
                        texel = sample_lanes(texels, images, image, tu + step_u * at, tv + step_v * at, footprint)
                        value.red += texel.red * part
                        value.green += texel.green * part
                        value.blue += texel.blue * part
                        value.alpha += texel.alpha * part
                    if k == 0:
                        color.x *= value.red * value.red
                        color.y *= value.green * value.green
                        color.z *= value.blue * value.blue
                        alpha = value.alpha
                    elif k == 1:
                        roughness *= value.green
                        metallic *= value.blue
                    elif k == 3:
                        emission.x *= value.red * value.red
                        emission.y *= value.green * value.green
                        emission.z *= value.blue * value.blue
                    else:
                        scale = materials[row + 11]
                        along = normalized3(sum3(tangent, scaled3(normal, 0.0 - dot3(normal, tangent))))
                        aside = ti.select(density < 0.0, vec16(-1.0), vec16(1.0))
                        across_x = (normal.y * along.z - normal.z * along.y) * aside
                        across_y = (normal.z * along.x - normal.x * along.z) * aside
                        across_z = (normal.x * along.y - normal.y * along.x) * aside
                        out_u = (value.red * 2.0 - 1.0) * scale
                        out_v = (value.green * 2.0 - 1.0) * scale
                        out_n = larger(value.blue * 2.0 - 1.0, vec16(0.1))
                        bent = normalized3(
                            Lanes3(
                                x=along.x * out_u + across_x * out_v + normal.x * out_n,
                                y=along.y * out_u + across_y * out_v + normal.y * out_n,
                                z=along.z * out_u + across_z * out_v + normal.z * out_n,
                            )
                        )
                        is_bent = ti.select(dot3(bent, direction) < -0.02, mine, ints16(0))
                        found.normal = select3(is_bent, bent, found.normal)
        glass = ti.cast(materials[row + 12] > 0.5, ti.i32)
        matt = 1.0 - ti.select(ints16(glass) != 0, vec16(0.0), metallic)
        found.diffuse = select3(mine, scaled3(color, matt), found.diffuse)
        dielectric = materials[row + 16] * (1.0 - metallic)
        specular = Lanes3(
            x=dielectric + color.x * metallic, y=dielectric + color.y * metallic, z=dielectric + color.z * metallic
        )
        found.specular = select3(mine, specular, found.specular)
        found.emission = select3(mine, emission, found.emission)
        roughness = smaller(larger(roughness, vec16(0.03)), vec16(1.0))
        found.roughness = ti.select(mine != 0, roughness, found.roughness)
        found.is_glass = ti.select(mine != 0, ints16(glass), found.is_glass)
        found.is_cut = ti.select((mine != 0) & (alpha < materials[row + 13]), ints16(1), found.is_cut)
    return found
