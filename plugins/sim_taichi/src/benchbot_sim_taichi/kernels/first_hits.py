# mypy: ignore-errors
"""First hits of camera rays, for 4 x 4 pixels at once. Such a square never reaches into another picture."""

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin, camera_ray
from benchbot_sim_taichi.kernels.lanes import ints16, vec16
from benchbot_sim_taichi.kernels.packet import RAYS, Packet, trace_packet
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats
from benchbot_sim_taichi.tables import CAMERA_STRIDE

TILE = 4
HIT_STRIDE = 8


@ti.kernel
def meet(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    cameras: floats,
    hits: floats,
    count: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Store the first hits of each pixel's middle: the nearest opaque triangle, and the nearest sheer one before it.

    Either is four values: distance (the camera's unit is planar depth; FAR none), u, v, and the triangle's bits.
    """
    columns = (width + TILE - 1) // TILE
    rows = (height + TILE - 1) // TILE
    for ray in range(count * columns * rows * RAYS):  # one thread takes 512 at least, which would be many as packets
        if ray % RAYS == 0:
            tile = ray // RAYS
            picture = tile // (columns * rows)
            inside = tile - picture * (columns * rows)
            left = inside % columns * TILE
            top = inside // columns * TILE
            eye = picture * CAMERA_STRIDE
            origin = camera_origin(cameras, eye)
            along_x, along_y, along_z = vec16(0.0), vec16(0.0), vec16(0.0)
            for i in range(RAYS):
                x = ti.cast(ti.min(left + i % TILE, width - 1), ti.f32) + 0.5
                y = ti.cast(ti.min(top + i // TILE, height - 1), ti.f32) + 0.5
                way = camera_ray(cameras, eye, x, y)
                along_x[i], along_y[i], along_z[i] = way.x, way.y, way.z
            # What is indexed at run time lies in memory: not the packet itself.
            rays = Packet(along_x=along_x, along_y=along_y, along_z=along_z, reach=vec16(FAR))
            rays.x, rays.y, rays.z = vec16(origin.x), vec16(origin.y), vec16(origin.z)
            root = 0
            slot = 0
            while root >= 0:
                rays.triangle = ints16(-1)
                trace_packet(nodes, leaves, root, rays, False)
                for i in ti.static(range(RAYS)):
                    x = left + i % TILE
                    y = top + i // TILE
                    if x < width and y < height:
                        at = ((picture * height + y) * width + x) * HIT_STRIDE + slot
                        hits[at] = ti.select(rays.triangle[i] >= 0, rays.reach[i], FAR)
                        hits[at + 1] = rays.u[i]
                        hits[at + 2] = rays.v[i]
                        hits[at + 3] = ti.bit_cast(rays.triangle[i], ti.f32)
                root = ti.select(root == 0, sheer_root, -1)
                slot += 4


@ti.func
def met(hits: ti.template(), pixel, slot):
    """Return a hit that `meet` stored: the nearest opaque one for `slot` 0, the sheer one before it for 1."""
    at = pixel * HIT_STRIDE + slot * 4
    return Hit(
        t=hits[at],
        triangle=ti.bit_cast(hits[at + 3], ti.i32),
        u=hits[at + 1],
        v=hits[at + 2],
    )
