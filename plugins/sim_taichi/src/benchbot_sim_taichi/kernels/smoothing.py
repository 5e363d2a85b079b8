# mypy: ignore-errors
"""Light at the nodes of surfaces, averaged among neighbours and packed; `bake` says what a node's raw light is."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.charts import NODE_STRIDE
from benchbot_sim_taichi.kernels.bake import RAW_STRIDE
from benchbot_sim_taichi.kernels.lightmap import LIGHT_WORDS, SUN_STEPS, VECTOR_STEPS
from benchbot_sim_taichi.kernels.traversal import floats, ints, vec3

SUN_EDGE = 0.02
AVERAGED = (*range(10), *range(12, RAW_STRIDE))  # without the sun's share and what a node counts


@ti.func
def distinction(source: ti.template(), one, other, by_light):
    """Return how much two nodes differ: in what is open and, with `by_light`, in direct light as part of all of both.

    Light by way of surfaces is left out, whose noise would be taken for edges.
    """
    found = 0.5 * ti.abs(source[one * RAW_STRIDE + 9] - source[other * RAW_STRIDE + 9])
    if by_light == 1:
        apart = 0.0
        total = 0.0
        for c in ti.static(range(9)):
            total += source[one * RAW_STRIDE + c] + source[other * RAW_STRIDE + c]
            if ti.static(c < 3):
                apart += source[one * RAW_STRIDE + c] - source[other * RAW_STRIDE + c]
        found += ti.abs(apart) / ti.max(total, 1e-9)
    return found


@ti.kernel
def smooth(
    source: floats,
    charted: ints,
    index: ints,
    target: floats,
    count: ti.i32,
    down: ti.i32,
    step: ti.i32,
    most_apart: ti.f32,
    by_light: ti.i32,
    first: ti.template(),
    last: ti.template(),
):
    """Average values `first` to `last` - 1 of charts' nodes over those `step` before and after.

    These count half, so that every stratum counts alike, and light is only moved: its sum stays. Nodes whose
    `distinction` (with `by_light` 1, else 0) is above `most_apart` count less, and nothing from twice that on, so that
    shadows keep their edges (edge-avoiding à-trous wavelets: Dammertz, Sewtz, Hanika and Lensch, 2010).
    """
    for node in range(count):
        at = node * RAW_STRIDE
        for c in ti.static(range(RAW_STRIDE)):
            target[at + c] = source[at + c]
        entry = charted[node * NODE_STRIDE]
        if entry >= 0:
            place = charted[node * NODE_STRIDE + ti.select(down == 1, 2, 1)]
            size = charted[node * NODE_STRIDE + ti.select(down == 1, 4, 3)]
            stride = step * ti.select(down == 1, charted[node * NODE_STRIDE + 3], 1)
            weights = 0.0
            total = ti.Vector([0.0] * RAW_STRIDE)
            for k in ti.static((-1, 1)):
                if 0 <= place + k * step < size:
                    other = index[entry + k * stride]
                    if other >= 0:
                        weight = 0.5 * source[other * RAW_STRIDE + 11]
                        weight *= ti.math.clamp(2.0 - distinction(source, node, other, by_light) / most_apart, 0.0, 1.0)
                        for c in ti.static(range(first, last)):
                            total[c] += weight * source[other * RAW_STRIDE + c]
                        weights += weight
            # What neighbours do not give stays here: otherwise nodes would count less at edges than beside them.
            own = ti.max(2.0 * source[at + 11] - weights, source[at + 11])
            for c in ti.static(range(first, last)):
                target[at + c] = (total[c] + own * source[at + c]) / (weights + own)


@ti.kernel
def smooth_loose(source: floats, charted: ints, first_link: ints, links: ints, target: floats, count: ti.i32):
    """Average the light of nodes that are not a chart's with that of their neighbours."""
    for node in range(count):
        at = node * RAW_STRIDE
        weight = 2.0 * source[at + 11]
        weights = weight
        total = ti.Vector([0.0] * RAW_STRIDE)
        for c in ti.static(AVERAGED):
            total[c] = weight * source[at + c]
        if charted[node * NODE_STRIDE] < 0:
            for k in range(first_link[node], first_link[node + 1]):
                other = links[k] * RAW_STRIDE
                for c in ti.static(AVERAGED):
                    total[c] += source[other + 11] * source[other + c]
                weights += source[other + 11]
        for c in ti.static(AVERAGED):
            target[at + c] = total[c] / weights
        target[at + 10] = source[at + 10]
        target[at + 11] = source[at + 11]


@ti.func
def sixteen_bits(value):
    """Exponent and eight bits of the fraction of a number that is not negative."""
    return ti.min((ti.bit_cast(ti.max(value, 0.0), ti.i32) + 0x4000) >> 15, 0xFEFF)


@ti.kernel
def finish(
    narrow: floats,
    wide: floats,
    charted: ints,
    index: ints,
    first_link: ints,
    links: ints,
    light: ints,
    count: ti.i32,
):
    """Pack each node's light into three words.

    They are irradiance of red and green; irradiance of blue, the sun's share, and a bit which says that a neighbour
    sees more or less of the sun; and the light vector, as a part of irradiance. Light from afar is that of `wide`, by
    the share of the hemisphere that is open in `narrow`: it changes slowly, while what hides it does not. What was
    found by chance is that of `wide`, too, and so is the light vector.
    """
    for node in range(count):
        at = node * RAW_STRIDE
        from_afar = narrow[at + 9] / ti.max(wide[at + 9], 1e-6)
        value = vec3(0.0)
        for c in ti.static(range(3)):
            value[c] = narrow[at + c] + narrow[at + 3 + c] + wide[at + 6 + c] * from_afar + wide[at + 12 + c]
        sun = narrow[at + 10]
        edge = 0
        entry = charted[node * NODE_STRIDE]
        if entry >= 0:
            x, y = charted[node * NODE_STRIDE + 1], charted[node * NODE_STRIDE + 2]
            width, height = charted[node * NODE_STRIDE + 3], charted[node * NODE_STRIDE + 4]
            for k in range(9):
                dx = k % 3 - 1
                dy = k // 3 - 1
                if 0 <= x + dx < width and 0 <= y + dy < height:
                    other = index[entry + dy * width + dx]
                    if other >= 0 and ti.abs(narrow[other * RAW_STRIDE + 10] - sun) > SUN_EDGE:
                        edge = 1
        else:
            for k in range(first_link[node], first_link[node + 1]):
                if ti.abs(narrow[links[k] * RAW_STRIDE + 10] - sun) > SUN_EDGE:
                    edge = 1
        at_light = node * LIGHT_WORDS
        light[at_light] = sixteen_bits(value.x) | sixteen_bits(value.y) << 16
        light[at_light + 1] = (
            sixteen_bits(value.z) | ti.cast(ti.math.clamp(sun, 0.0, 1.0) * SUN_STEPS + 0.5, ti.i32) << 16 | edge << 31
        )
        packed = 0
        for c in ti.static(range(3)):
            part = ti.math.clamp(wide[at + 15 + c] / wide[at + 18], -1.0, 1.0)
            packed |= (ti.cast(part * VECTOR_STEPS + 0.5 + VECTOR_STEPS, ti.i32)) << (10 * c)
        light[at_light + 2] = packed
