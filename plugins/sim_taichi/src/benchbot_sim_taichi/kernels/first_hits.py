# mypy: ignore-errors
"""First hits of camera rays, for 4 x 4 pixels at once. Such a square never reaches into another picture.

A square has `HITS_STRIDE` values, sixteen of each kind: of the nearest opaque triangles distance (the camera's unit is
planar depth; FAR none), u, v and the bits of the triangle, then the same of the nearest sheer ones before them.

Or for `SAMPLES` points each of four listed pixels at once, where edges are looked at more closely.
"""

from typing import Any

import numpy as np

from benchbot_sim_taichi._ti import ti
from benchbot_sim_taichi.kernels.camera import camera_origin
from benchbot_sim_taichi.kernels.lanes import Lanes3, from_bits, ints16, vec16
from benchbot_sim_taichi.kernels.lens import undistort
from benchbot_sim_taichi.kernels.packet import RAYS, Packet, trace_packet
from benchbot_sim_taichi.kernels.traversal import FAR, Hit, floats, ints
from benchbot_sim_taichi.tables import CAMERA_STRIDE

TILE = 4
HITS_STRIDE = 8 * RAYS
ACROSS = [float(i % TILE) for i in range(RAYS)]
DOWN = [float(i // TILE) for i in range(RAYS)]
SAMPLES = 4
PIXELS_AT_ONCE = RAYS // SAMPLES
SQUARES = np.full(1, -1, np.int32)
"""In the place of a list of pixels: squares of all pixels."""


def squares(count: int, width: int, height: int) -> int:
    """Return the number of squares that some pictures have."""
    return count * -(-width // TILE) * -(-height // TILE)


def hits_size(count: int, width: int, height: int) -> int:
    """Return the number of values that the hits of some pictures have."""
    return squares(count, width, height) * HITS_STRIDE


def meet_squares(
    nodes: Any, leaves: Any, sheer_root: int, cameras: Any, hits: Any, count: int, width: int, height: int
) -> None:
    """Store the first hits of the middles of all pixels."""
    tiles = squares(count, width, height)
    meet(nodes, leaves, sheer_root, cameras, SQUARES, hits, tiles, width, height)


@ti.func
def tile_counts(width, height):
    """Squares in a row of a picture, and in all of it."""
    columns = (width + TILE - 1) // TILE
    return columns, columns * ((height + TILE - 1) // TILE)


@ti.func
def locate_tile(tile, width, height):
    """Picture, leftmost column and topmost row of a square."""
    columns, in_all = tile_counts(width, height)
    picture = tile // in_all
    row = (tile - picture * in_all) // columns
    return picture, (tile - picture * in_all - row * columns) * TILE, row * TILE


@ti.func
def camera_rays(cameras: ti.template(), eye, x, y):
    """`camera.camera_ray` through sixteen points."""
    across = (x - cameras[eye + 14]) / cameras[eye + 12]
    down = (y - cameras[eye + 15]) / cameras[eye + 13]
    if cameras[eye + 19] != 0.0:
        bent_across, bent_down = across, down  # what is indexed at run time lies in memory
        for lane in range(RAYS):
            lens_x, lens_y = undistort(cameras, eye + 20, bent_across[lane], bent_down[lane])
            bent_across[lane], bent_down[lane] = lens_x, lens_y
        across, down = bent_across, bent_down
    return Lanes3(
        x=cameras[eye] * across + cameras[eye + 1] * down + cameras[eye + 2],
        y=cameras[eye + 3] * across + cameras[eye + 4] * down + cameras[eye + 5],
        z=cameras[eye + 6] * across + cameras[eye + 7] * down + cameras[eye + 8],
    )


@ti.dataclass
class Points:
    """Sixteen points of one picture: `x` and `y` in pixels.

    `number` is another one for each point of a picture; `place` is where its values are kept, -1 for none.
    """

    picture: ti.i32
    x: vec16
    y: vec16
    number: ints16
    place: ints16


@ti.func
def point_in_pixel(x, y, sample):
    """Return a point of a pixel for each sample, on a rotated grid: four rows, four columns, one sample in each."""
    across = ti.cast(x, ti.f32) + (ti.cast((sample * 2 + sample // 2) % SAMPLES, ti.f32) + 0.5) * (1.0 / SAMPLES)
    down = ti.cast(y, ti.f32) + (ti.cast(sample, ti.f32) + 0.5) * (1.0 / SAMPLES)
    return across, down


@ti.func
def points_of(tile, pixels: ti.template(), width, height):
    """The middles of a square's pixels; or, if there is a list of `pixels`, the samples of four of them.

    A list has multiples of four pixels, all four of the same picture; -1 takes the place of pixels that are missing,
    but never of the first of the four.
    """
    picture, left, top = locate_tile(tile, width, height)
    points = Points(picture=picture, x=vec16(ACROSS), y=vec16(DOWN), number=ints16(0), place=ints16(-1))
    if pixels.shape[0] > 1:
        points.picture = pixels[tile * PIXELS_AT_ONCE] // (width * height)
        for k in range(PIXELS_AT_ONCE):
            listed = pixels[tile * PIXELS_AT_ONCE + k]
            inside = ti.select(listed < 0, pixels[tile * PIXELS_AT_ONCE], listed) - points.picture * (width * height)
            y = inside // width
            for s in range(SAMPLES):
                lane = k * SAMPLES + s
                points.x[lane], points.y[lane] = point_in_pixel(inside - y * width, y, s)
                points.number[lane] = inside * SAMPLES + s
                points.place[lane] = ti.select(listed < 0, -1, tile * RAYS + lane)
    else:
        x, y = ints16([i % TILE for i in range(RAYS)]) + left, ints16([i // TILE for i in range(RAYS)]) + top
        points.x += ti.cast(left, ti.f32) + 0.5
        points.y += ti.cast(top, ti.f32) + 0.5
        points.number = y * width + x
        points.place = ti.select((x < width) & (y < height), points.number + picture * (width * height), ints16(-1))
    return points


@ti.kernel
def meet(
    nodes: floats,
    leaves: floats,
    sheer_root: ti.i32,
    cameras: floats,
    pixels: ints,
    hits: floats,
    tiles: ti.i32,
    width: ti.i32,
    height: ti.i32,
):
    """Store the first hits of `tiles` times sixteen points: `points_of`."""
    for ray in range(tiles * RAYS):  # one thread takes 512 at least, which would be many as packets
        if ray % RAYS == 0:
            tile = ray // RAYS
            points = points_of(tile, pixels, width, height)
            eye = points.picture * CAMERA_STRIDE
            origin = camera_origin(cameras, eye)
            way = camera_rays(cameras, eye, points.x, points.y)
            rays = Packet(along_x=way.x, along_y=way.y, along_z=way.z, reach=vec16(FAR))
            rays.x, rays.y, rays.z = vec16(origin.x), vec16(origin.y), vec16(origin.z)
            root = 0
            at = tile * HITS_STRIDE
            while root >= 0:
                rays.triangle = ints16(-1)
                trace_packet(nodes, leaves, root, rays, False)
                reach = ti.select(rays.triangle >= 0, rays.reach, vec16(FAR))
                bits = from_bits(rays.triangle)
                for lane in ti.static(range(RAYS)):
                    hits[at + lane] = reach[lane]
                    hits[at + RAYS + lane] = rays.u[lane]
                    hits[at + 2 * RAYS + lane] = rays.v[lane]
                    hits[at + 3 * RAYS + lane] = bits[lane]
                root = ti.select(root == 0, sheer_root, -1)
                at += 4 * RAYS


@ti.func
def place_of_hits(pixel, width, height):
    """Where the hits of a pixel are."""
    columns, in_all = tile_counts(width, height)
    picture = pixel // (width * height)
    y = (pixel - picture * (width * height)) // width
    x = pixel - picture * (width * height) - y * width
    return (picture * in_all + y // TILE * columns + x // TILE) * HITS_STRIDE + y % TILE * TILE + x % TILE


@ti.func
def met(hits: ti.template(), place, slot):
    """Return a hit that `meet` stored: the nearest opaque one for `slot` 0, the sheer one before it for 1."""
    at = place + slot * 4 * RAYS
    return Hit(
        t=hits[at],
        triangle=ti.bit_cast(hits[at + 3 * RAYS], ti.i32),
        u=hits[at + RAYS],
        v=hits[at + 2 * RAYS],
    )
