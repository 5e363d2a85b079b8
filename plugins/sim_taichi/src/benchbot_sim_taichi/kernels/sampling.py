# mypy: ignore-errors
"""Sample points and directions, what a sample counts, and small integer hashes."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.traversal import vec3

TWO_PI = 6.28318530717958647692
ONE_OVER_2_32 = 2.3283064365386963e-10


@ti.func
def hash_u32(x):
    """Integer hash (Wellons, "Prospecting for hash functions", lowbias32)."""
    h = ti.cast(x, ti.u32)
    h ^= h >> 16
    h *= ti.u32(0x7FEB352D)
    h ^= h >> 15
    h *= ti.u32(0x846CA68B)
    h ^= h >> 16
    return h


@ti.func
def draw(state):
    """Next number in 0 … 1 and the state after it (a counter, hashed)."""
    following = state + ti.u32(0x9E3779B9)
    return ti.cast(hash_u32(following), ti.f32) * ONE_OVER_2_32, following


@ti.func
def evenly_spread(index, number):
    """Return term `index` of the golden ratio's sequence in 0 … 1, turned by a hash of `number`."""
    term = ti.cast(index, ti.u32) * ti.u32(0x9E3779B9) + hash_u32(number)
    return ti.cast(term >> 8, ti.f32) / 16777216.0


@ti.func
def interleave_index(x, y):
    """Rank 0 … 63 of a pixel in its 8x8 tile; the 16 of any 4x4 window differ in their low four bits."""
    index = 0
    for bit in ti.static(range(3)):
        xb = (x >> bit) & 1
        yb = (y >> bit) & 1
        index |= (xb ^ yb) << (2 * bit) | yb << (2 * bit + 1)
    return index


@ti.func
def sobol_2d(index, scramble):
    """Point `index` of the first two Sobol dimensions, digit-scrambled; every aligned run of 2^k is a (0, k, 2)-net.

    Kollig and Keller, "Efficient multidimensional sampling", 2002.
    """
    i = ti.cast(index, ti.u32)
    seed = ti.cast(scramble, ti.u32)
    x = hash_u32(seed)
    y = hash_u32(seed ^ ti.u32(0x9E3779B9))
    first = ti.u32(0x80000000)
    second = ti.u32(0x80000000)
    while i != 0:
        if i & 1:
            x ^= first
            y ^= second
        i >>= 1
        first >>= 1
        second ^= second >> 1
    return ti.Vector([ti.cast(x >> 8, ti.f32) / 16777216.0, ti.cast(y >> 8, ti.f32) / 16777216.0])


@ti.func
def power_share(density, other):
    """Return the weight of a sample found with `density` that another strategy would find with density `other`.

    Power heuristic: Veach, "Robust Monte Carlo methods for light transport simulation", 1997.
    """
    ratio = other / ti.max(density, 1e-20)
    return 1.0 / (1.0 + ratio * ratio)


@ti.func
def bounded(color, brightest):
    """Return the colour scaled down to be no brighter than `brightest`."""
    return color * ti.min(1.0, brightest / ti.max(color.max(), 1e-20))


@ti.func
def orthonormal(n):
    """Two unit vectors that complete `n` to a right-handed frame (Duff et al., JCGT 2017)."""
    sign = ti.select(n.z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + n.z)
    b = n.x * n.y * a
    return (
        vec3(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        vec3(b, sign + n.y * n.y * a, -n.y),
    )


@ti.func
def cosine_direction(n, point):
    """Direction around `n` with density cos / pi."""
    tangent, bitangent = orthonormal(n)
    radius = ti.sqrt(point.x)
    angle = TWO_PI * point.y
    height = ti.sqrt(ti.max(0.0, 1.0 - point.x))
    return (tangent * (radius * ti.cos(angle)) + bitangent * (radius * ti.sin(angle)) + n * height).normalized()


@ti.func
def cone_direction(axis, cos_max, point):
    """Direction uniform in the cone around `axis`."""
    tangent, bitangent = orthonormal(axis)
    height = 1.0 - point.x * (1.0 - cos_max)
    radius = ti.sqrt(ti.max(0.0, 1.0 - height * height))
    angle = TWO_PI * point.y
    return (tangent * (radius * ti.cos(angle)) + bitangent * (radius * ti.sin(angle)) + axis * height).normalized()
