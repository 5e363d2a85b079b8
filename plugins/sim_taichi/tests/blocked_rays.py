# mypy: ignore-errors
"""Whether anything is in the way of rays, for `test_packet`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.packet import RAYS, packet_from, trace_packet
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import floats, ints, trace


@ti.kernel
def find_blocked(
    nodes: floats, leaves: floats, origins: floats, ways: floats, together: ints, alone: ints, count: ti.i32
):
    """1 where a ray meets something before the end of its way: sixteen at once, one by one."""
    for number in range((count + RAYS - 1) // RAYS):
        first = number * RAYS
        rays = packet_from(origins, ways, first, count, 1.0)
        trace_packet(nodes, leaves, 0, rays, True)
        for lane in ti.static(range(RAYS)):
            ray = first + lane
            if ray < count:
                hit = trace(nodes, leaves, 0, load3(origins, ray * 3), load3(ways, ray * 3), 1.0, True)
                together[ray] = ti.cast(rays.reach[lane] < 0.0, ti.i32)
                alone[ray] = ti.cast(hit.triangle >= 0, ti.i32)
