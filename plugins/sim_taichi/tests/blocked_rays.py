# mypy: ignore-errors
"""Whether anything is in the way of rays, for `test_packet`."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.lanes import vec16
from benchbot_sim_taichi.kernels.packet import RAYS, Packet, trace_packet
from benchbot_sim_taichi.kernels.surface import load3
from benchbot_sim_taichi.kernels.traversal import floats, ints, trace


@ti.kernel
def find_blocked(
    nodes: floats, leaves: floats, origins: floats, ways: floats, together: ints, alone: ints, count: ti.i32
):
    """1 where a ray meets something before the end of its way: sixteen at once (`count` is a multiple), one by one."""
    for first in range(count // RAYS):
        rays = Packet(reach=vec16(1.0))
        for lane in ti.static(range(RAYS)):
            at = (first * RAYS + lane) * 3
            rays.x[lane], rays.y[lane], rays.z[lane] = origins[at], origins[at + 1], origins[at + 2]
            rays.along_x[lane], rays.along_y[lane], rays.along_z[lane] = ways[at], ways[at + 1], ways[at + 2]
        trace_packet(nodes, leaves, 0, rays, True)
        for lane in ti.static(range(RAYS)):
            ray = first * RAYS + lane
            together[ray] = ti.cast(rays.reach[lane] < 0.0, ti.i32)
            alone[ray] = ti.cast(
                trace(nodes, leaves, 0, load3(origins, ray * 3), load3(ways, ray * 3), 1.0, True).triangle >= 0, ti.i32
            )
