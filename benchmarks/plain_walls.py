"""Plain walls in a picture, and how uneven the light on them is.

A plain wall is a large flat region of one object whose material has next to no texture, eroded, away from edges of
shadows. Its unevenness is what a band-pass leaves of its luminance: waves of 4 to 30 pixels, too long for grain and too
short for the falling off of light across a room. There is little of it on a real wall, and a feature detector takes it
for texture.

A Gaussian halves the amplitude of waves of `WAVE_PER_SIGMA` times its standard deviation; the band is the difference of
the two that halve 4 and 30 pixels. Gaussians are taken of each wall alone (weights outside are zero, and the sum of the
weights inside divides), so that nothing beside it counts.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi.renderer import Frame, Intrinsics
from benchmarks.bench_quality import LUMA

BAND_PX = (4.0, 30.0)
WAVE_PER_SIGMA = np.pi * np.sqrt(2.0 / np.log(2.0))
MARGIN_PX = 5
LEAST_SHARE = 0.005  # of the picture's pixels
PLAIN_CONTRAST = 2.0  # standard deviation of an image's bytes: paint has 1.3, carpet 13
LEAST_ROUGHNESS = 0.3  # a shinier wall shows what it mirrors
BEND = 1e-4  # relative change of slope of inverse depth between pixels: at 3 m a curve of 0.5 m at 480 pixels
IN_PLANE_M = 0.005
EDGE_SIGMA_PX = 2.0
EDGE_BYTES_PER_PX = 1.0

Image = npt.NDArray[Any]
Labels = npt.NDArray[np.int32]


def find(scene: SceneGeometry, frame: Frame, camera_to_map: Image, camera: Intrinsics, reference: Image) -> Labels:
    """(H, W): the number of the plain wall that a pixel belongs to, 0 none.

    `frame` has depth and instances of what `reference`, an (H, W, 3) picture in bytes, shows; only the reference says
    where shadows end.
    """
    height, width = frame.depth_m.shape
    least_px = LEAST_SHARE * height * width
    away = ~ndimage.binary_dilation(has_edge(reference @ LUMA), iterations=MARGIN_PX)
    walls = np.zeros((height, width), np.int32)
    for region in flat_regions(frame.depth_m, frame.instance, least_px):
        (instance,) = np.unique(frame.instance[region])
        plane = _plane(frame.depth_m, region)
        if plane is None or not _is_plain(scene, int(instance), _plane_in_map(plane, camera_to_map, camera)):
            continue
        inside = ndimage.distance_transform_edt(np.pad(region, 1, mode="edge"))[1:-1, 1:-1] > MARGIN_PX
        for wall in _parts(inside & away, least_px):
            walls[wall] = walls.max() + 1
    return walls


def flat_regions(depth_m: Image, instance: npt.NDArray[np.integer], least_px: float) -> Iterator[npt.NDArray[np.bool_]]:
    """Connected (H, W) regions of one instance in which inverse depth is, from pixel to pixel, that of a plane."""
    inverse = np.divide(1.0, depth_m, out=np.zeros(depth_m.shape), where=np.isfinite(depth_m) & (depth_m > 0))
    is_flat = (inverse > 0) & (instance > 0)
    for axis in (0, 1):
        bend = np.abs(np.diff(inverse, 2, axis=axis))
        changes = np.diff(instance, axis=axis) != 0
        is_flat &= _along(bend, axis, (1, 1)) <= BEND * inverse
        is_flat &= ~(_along(changes, axis, (1, 0)) | _along(changes, axis, (0, 1)))
    yield from _parts(is_flat, least_px)


def has_edge(luma: Image) -> npt.NDArray[np.bool_]:
    """Pixels of (H, W) bytes at which light changes as at the edge of a shadow."""
    return np.asarray(ndimage.gaussian_gradient_magnitude(luma, EDGE_SIGMA_PX, mode="nearest") > EDGE_BYTES_PER_PX)


def band(luma: Image, walls: Labels) -> Image:
    """(N,) luminance of `walls`' pixels, wall by wall, without waves shorter than 4 and longer than 30 pixels."""
    values = []
    for number, where in enumerate(ndimage.find_objects(walls), start=1):
        wall = walls[where] == number
        short, long = (_blurred(luma[where], wall, wave_px / WAVE_PER_SIGMA) for wave_px in BAND_PX)
        values.append((short - long)[wall])
    return np.concatenate(values)


def covariance(one: Image, other: Image, walls: Labels) -> float:
    """Mean product of two pictures' (H, W, 3) bands on walls, in bytes squared; of a picture with itself its variance.

    Of two pictures of the same with noise of their own it is the variance without the noise, which averages out; so it
    may come out a little below zero.
    """
    return float(np.mean(band(one @ LUMA, walls) * band(other @ LUMA, walls)))


def _along(values: Image, axis: int, widths: tuple[int, int]) -> Image:
    """Values with so many zeros before and after them along an axis."""
    return np.pad(values, [widths if axis == other else (0, 0) for other in range(values.ndim)])


def _blurred(luma: Image, wall: npt.NDArray[np.bool_], sigma_px: float) -> Image:
    weight = ndimage.gaussian_filter(wall.astype(float), sigma_px, mode="constant")
    total = ndimage.gaussian_filter(np.where(wall, luma, 0.0), sigma_px, mode="constant")
    blurred: Image = np.divide(total, weight, out=np.zeros_like(total), where=wall)
    return blurred


def _parts(mask: npt.NDArray[np.bool_], least_px: float) -> Iterator[npt.NDArray[np.bool_]]:
    labels, count = ndimage.label(mask)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    for number in range(1, count + 1):
        if sizes[number] >= least_px:
            yield labels == number


def _plane(depth_m: Image, region: npt.NDArray[np.bool_]) -> Image | None:
    """(a, b, c) of inverse depth a u + b v + c at continuous (u, v) on a region, or None where that is not so."""
    row, column = np.nonzero(region)
    places = np.stack([column + 0.5, row + 0.5, np.ones(len(row))], axis=1)
    inverse = 1.0 / depth_m[region].astype(float)
    plane: Image = np.linalg.lstsq(places, inverse, rcond=None)[0]
    return plane if np.abs(places @ plane - inverse).max() <= 1e-3 * inverse.max() else None


def _plane_in_map(plane: Image, camera_to_map: Image, camera: Intrinsics) -> Image:
    """(nx, ny, nz, d), unit n, with n x + d = 0 on the plane."""
    a, b, c = plane
    in_camera = np.array([a * camera.fx, b * camera.fy, a * camera.cx + b * camera.cy + c])
    normal = camera_to_map[:3, :3] @ in_camera
    plane_in_map: Image = np.append(normal, -1.0 - normal @ camera_to_map[:3, 3]) / np.linalg.norm(normal)
    return plane_in_map


def _is_plain(scene: SceneGeometry, instance: int, plane: Image) -> bool:
    """True if all that an instance has in a plane is of one plain material."""
    mine = np.flatnonzero(scene.triangle_instance == instance)
    away_m = np.abs(scene.vertices @ plane[:3] + plane[3])
    there = mine[(away_m[scene.triangles[mine]] <= IN_PLANE_M).all(axis=1)]
    materials = np.unique(scene.triangle_material[there])
    if len(materials) != 1:
        return False
    material = scene.materials[materials[0]]
    images = [] if material.base_color_image is None else [scene.images[material.base_color_image][..., :3]]
    return (
        all(image.std(axis=(0, 1)).max() <= PLAIN_CONTRAST for image in images)
        and material.normal_image is None
        and material.roughness >= LEAST_ROUGHNESS
        and not (material.is_emissive or material.is_glass or material.alpha_cutoff is not None)
    )
