# mypy: ignore-errors
"""What `kernels.lanes` makes of sixteen values, for `test_lanes`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import absolute, largest, load4, load8, mask_of, negated, vec16
from benchbot_sim_taichi.kernels.traversal import floats, ints


@ti.kernel
def work_out(values: floats, negatives: floats, magnitudes: floats, greatest: floats, masks: ints):
    """The first eight negated, the next four without their sign, the largest of all, which of both halves exceed 0."""
    first, second = load8(values, 0), load8(values, 8)
    opposite, magnitude = negated(first), absolute(load4(values, 8))
    for i in ti.static(range(8)):
        negatives[i] = opposite[i]
    for i in ti.static(range(4)):
        magnitudes[i] = magnitude[i]
    greatest[0] = largest(vec16([values[i] for i in range(16)]))
    masks[0] = mask_of(first > 0.0)
    masks[1] = mask_of((second > 0.0) & (second < 10.0))
