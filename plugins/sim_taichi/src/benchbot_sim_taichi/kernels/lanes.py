# mypy: ignore-errors
"""Vectors that the processor works on as a whole, one instruction for all of their lanes.

On a processor Taichi hands vectors of any length on to the compiler as they are (`_ti.start`), which makes of them what
the machine has: AVX, AVX-512 or Neon. On a GPU it takes them apart.

Taichi 1.7 cannot negate a whole vector, take its absolute value, or reckon with powers, exponentials and angles of one:
it ends the process ("Not supported", or "an integer operation on a non-integer type", also for `-=`), as it does when
it is to turn one into integers; nor can it keep what one comparison of vectors says in a variable ("Ptr must be a
pointer to Val type"). What kernels need instead is here.
"""

from benchbot_sim_taichi._ti import ti

vec4 = ti.types.vector(4, ti.f32)
vec8 = ti.types.vector(8, ti.f32)
vec16 = ti.types.vector(16, ti.f32)
ints8 = ti.types.vector(8, ti.i32)
ints16 = ti.types.vector(16, ti.i32)
LANES = list(range(16))
LANE_BITS = [1 << lane for lane in range(16)]


@ti.dataclass
class Lanes3:
    """Sixteen vectors of three values, or sixteen colours."""

    x: vec16
    y: vec16
    z: vec16


@ti.func
def negated(vector):
    """`-vector`."""
    return 0.0 - vector


@ti.func
def absolute(vector):
    """The absolute value of each lane."""
    return ti.select(vector < 0.0, 0.0 - vector, vector)


@ti.func
def load4(array: ti.template(), at):
    """Four values that lie side by side; one load where the compiler can tell that `at` is a multiple of 4."""
    return vec4([array[at + i] for i in range(4)])


@ti.func
def load8(array: ti.template(), at):
    """Eight values that lie side by side; one load where the compiler can tell that `at` is a multiple of 8."""
    return vec8([array[at + i] for i in range(8)])


@ti.func
def mask_of(flags: ti.template()):
    """The bits of eight lanes' truth values, the first lane's in bit 30."""
    bits = ti.select(flags, ints8([1 << (30 - i) for i in range(8)]), ints8(0))
    mask = 0
    for i in ti.static(range(8)):
        mask |= bits[i]
    return mask


@ti.func
def union(bits):
    """The bits that are set in any of sixteen lanes."""
    result = 0
    for i in ti.static(range(16)):
        result |= bits[i]
    return result


@ti.func
def smaller(one, other):
    """The smaller of two in each lane; one instruction, where `ti.min` takes three to say what becomes of NaN."""
    return ti.select(one < other, one, other)


@ti.func
def larger(one, other):
    """The larger of two in each lane; see `smaller`."""
    return ti.select(one > other, one, other)


@ti.func
def largest(lanes):
    """The largest of sixteen lanes, found by halves."""
    half = larger(vec8([lanes[i] for i in range(8)]), vec8([lanes[i + 8] for i in range(8)]))
    quarter = larger(vec4([half[i] for i in range(4)]), vec4([half[i + 4] for i in range(4)]))
    return larger(larger(quarter[0], quarter[1]), larger(quarter[2], quarter[3]))


@ti.func
def lanes3(vector):
    """The same three values in all lanes."""
    return Lanes3(x=vec16(vector.x), y=vec16(vector.y), z=vec16(vector.z))


@ti.func
def dot3(one: ti.template(), other: ti.template()):
    """Sixteen scalar products."""
    return one.x * other.x + one.y * other.y + one.z * other.z


@ti.func
def scaled3(vectors: ti.template(), factors):
    """Each vector times its lane's factor."""
    return Lanes3(x=vectors.x * factors, y=vectors.y * factors, z=vectors.z * factors)


@ti.func
def sum3(one: ti.template(), other: ti.template()):
    """Sixteen sums."""
    return Lanes3(x=one.x + other.x, y=one.y + other.y, z=one.z + other.z)


@ti.func
def product3(one: ti.template(), other: ti.template()):
    """Sixteen products of colours."""
    return Lanes3(x=one.x * other.x, y=one.y * other.y, z=one.z * other.z)


@ti.func
def select3(mine: ti.template(), one: ti.template(), other: ti.template()):
    """`one` in lanes that are not 0, `other` elsewhere."""
    return Lanes3(
        x=ti.select(mine != 0, one.x, other.x),
        y=ti.select(mine != 0, one.y, other.y),
        z=ti.select(mine != 0, one.z, other.z),
    )


@ti.func
def lane3(vectors: ti.template(), lane):
    """The vector of one lane, known while compiling or at run time."""
    return ti.Vector([vectors.x[lane], vectors.y[lane], vectors.z[lane]])


@ti.func
def to_ints(lanes):
    """Truncated to integers."""
    result = ints16(0)
    for lane in range(16):
        result[lane] = ti.cast(lanes[lane], ti.i32)
    return result


@ti.func
def to_floats(lanes):
    """Integers as floating-point numbers."""
    result = vec16(0.0)
    for lane in range(16):
        result[lane] = ti.cast(lanes[lane], ti.f32)
    return result


@ti.func
def bits_of(lanes):
    """The bits of floating-point numbers."""
    result = ints16(0)
    for lane in range(16):
        result[lane] = ti.bit_cast(lanes[lane], ti.i32)
    return result


@ti.func
def from_bits(lanes):
    """Inverse of `bits_of`."""
    result = vec16(0.0)
    for lane in range(16):
        result[lane] = ti.bit_cast(lanes[lane], ti.f32)
    return result


@ti.func
def gather(array: ti.template(), at):
    """The floating-point numbers at sixteen places."""
    result = vec16(0.0)
    for lane in range(16):
        result[lane] = array[at[lane]]
    return result


@ti.func
def gather_ints(array: ti.template(), at):
    """The integers at sixteen places."""
    result = ints16(0)
    for lane in range(16):
        result[lane] = array[at[lane]]
    return result


@ti.func
def load16(array: ti.template(), at):
    """Sixteen values that lie side by side."""
    return vec16([array[at + i] for i in range(16)])


@ti.func
def load_ints16(array: ti.template(), at):
    """Sixteen integers that lie side by side."""
    return ints16([array[at + i] for i in range(16)])


@ti.func
def equal_lanes(lanes, value):
    """The bits of the lanes that are equal to a value."""
    return ti.select(lanes == value, ints16(LANE_BITS), ints16(0))


@ti.func
def normalized3(vectors: ti.template()):
    """Unit vectors; zero stays what it is."""
    return scaled3(vectors, 1.0 / ti.sqrt(larger(dot3(vectors, vectors), vec16(1e-18))))
