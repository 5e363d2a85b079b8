# mypy: ignore-errors
"""Transmission of light by panes and cut-outs between two points."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.reflectance import pane_reflectance
from benchbot_sim_taichi.kernels.surface import load3, texel, wrap
from benchbot_sim_taichi.kernels.traversal import Hit, trace, vec3
from benchbot_sim_taichi.tables import MATERIAL_STRIDE, TRIANGLE_STRIDE
from benchbot_sim_taichi.textures import IMAGE_STRIDE

MOST_SHARE = 4.0  # of rays that stand for others
MAX_LAYERS = 12
STEP_M = 1e-4
LEAST_PASSED = 1e-6


@ti.dataclass
class Passage:
    """The light that passes: its `share` of each colour, and the number of `panes` on the way."""

    share: vec3
    panes: ti.i32


@ti.func
def sheerness(
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    triangle,
    u,
    v,
    direction,
):
    """Return the transmission of one sheer triangle along unit `direction`: a pane's tint less its reflectance.

    Textures are looked up without blending: shadows are blurred anyway, and the sampler is long to compile.
    """
    base = triangle * TRIANGLE_STRIDE
    row = ti.cast(triangles[base + 18], ti.i32) * MATERIAL_STRIDE
    color = load3(materials, row)
    alpha = 1.0
    image = ti.cast(materials[row + 8], ti.i32)
    if image >= 0:
        w = 1.0 - u - v
        tu = triangles[base + 9] * w + triangles[base + 11] * u + triangles[base + 13] * v
        tv = triangles[base + 10] * w + triangles[base + 12] * u + triangles[base + 14] * v
        width = images[image * IMAGE_STRIDE + 1]
        height = images[image * IMAGE_STRIDE + 2]
        x = wrap(ti.cast((tu - ti.floor(tu)) * ti.cast(width, ti.f32), ti.i32), width)
        y = wrap(ti.cast((tv - ti.floor(tv)) * ti.cast(height, ti.f32), ti.i32), height)
        value = texel(texels, images[image * IMAGE_STRIDE] + y * width + x)
        color *= vec3(value.x * value.x, value.y * value.y, value.z * value.z)
        alpha = value.w
    passed = Passage(share=vec3(0.0), panes=0)
    if alpha < materials[row + 13]:
        passed.share = vec3(1.0)
    elif materials[row + 12] > 0.5:
        cosine = ti.abs(load3(triangles, base + 15).dot(direction))
        passed.share = color * (1.0 - pane_reflectance(materials[row + 16], cosine))
        passed.panes = 1
    return passed


@ti.func
def sent(
    nodes: ti.template(),
    leaves: ti.template(),
    sheer_root,
    triangles: ti.template(),
    materials: ti.template(),
    texels: ti.template(),
    images: ti.template(),
    origin,
    direction,
    reach,
):
    """Return the transmission up to `reach` along unit `direction` from `origin`: zero if an opaque triangle is there.

    Opaque and sheer triangles are traced by one call, for any hit: each further call makes a kernel slower to compile,
    and a search for the nearest hit takes longer. A sheer triangle is the nearest once there is no other before it.
    """
    passed = Passage(share=vec3(1.0), panes=0)
    # Its distance counts from `start`, as it came from the tree: sums are rounded, and might let it be found again.
    found = Hit(t=reach, triangle=-1, u=0.0, v=0.0)
    root = 0
    start = 0.0
    layers = 0
    while root >= 0:
        hit = trace(nodes, leaves, root, origin + direction * start, direction, found.t, True)
        if root == 0:
            if hit.triangle >= 0:
                passed.share = vec3(0.0)
            root = ti.select(hit.triangle >= 0, -1, sheer_root)
        elif hit.triangle >= 0:
            found = hit
        elif found.triangle >= 0 and layers < MAX_LAYERS:
            layer = sheerness(triangles, materials, texels, images, found.triangle, found.u, found.v, direction)
            passed.share *= layer.share
            passed.panes += layer.panes
            layers += 1
            start += found.t + STEP_M
            found.t = reach - start
            found.triangle = -1
            root = ti.select(passed.share.max() < LEAST_PASSED, -1, root)
        else:
            root = -1
    return passed


@ti.func
def pack(share):
    """Three shares of 0 … `MOST_SHARE` in the bits of one number, ten bits each; to be copied, not reckoned with."""
    red = ti.cast(ti.math.clamp(share.x / MOST_SHARE, 0.0, 1.0) * 1023.0 + 0.5, ti.i32)
    green = ti.cast(ti.math.clamp(share.y / MOST_SHARE, 0.0, 1.0) * 1023.0 + 0.5, ti.i32)
    blue = ti.cast(ti.math.clamp(share.z / MOST_SHARE, 0.0, 1.0) * 1023.0 + 0.5, ti.i32)
    return red | green << 10 | blue << 20


@ti.func
def unpack(bits):
    """The shares that `pack` packed."""
    return vec3(
        ti.cast(bits & 1023, ti.f32) * (MOST_SHARE / 1023.0),
        ti.cast(bits >> 10 & 1023, ti.f32) * (MOST_SHARE / 1023.0),
        ti.cast(bits >> 20 & 1023, ti.f32) * (MOST_SHARE / 1023.0),
    )
