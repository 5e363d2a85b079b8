"""A scene from above with its ceiling cut away: textured, shaded by the sky and by what stands around."""

import io

import numpy as np
import numpy.typing as npt
from PIL import Image
from scipy import ndimage

from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.slab import project_slab, rasterise
from benchbot_scenes.visibility import surface_points

Floats = npt.NDArray[np.float64]
CUT_M = 2.0
PIXEL_M = 0.012
LARGEST_PIXELS = 2400
# So many triangles are drawn at a time, which bounds the memory.
BATCH_POINTS = 4_000_000
CUT_COLOR = (0.13, 0.13, 0.14)
BACKGROUND = (1.0, 1.0, 1.0)
TOWARDS_LIGHT = np.array([-0.35, -0.25, 0.90])


def top_down(geometry: SceneGeometry, floor_z_m: float = 0.0, pixel_m: float = PIXEL_M) -> Image.Image:
    """Draw what lies below 2 m above the floor, +y upwards: an orthographic picture, white where nothing is."""
    corners = geometry.vertices[geometry.triangles].astype(np.float64)
    cut_m = floor_z_m + CUT_M
    drawn = np.isfinite(corners).all((1, 2)) & (corners[..., 2].min(1) < cut_m)
    opaque = np.array([material.transmission < 0.5 for material in geometry.materials], bool)
    drawn &= opaque[geometry.triangle_material] & ~_is_upright(corners)
    which = np.flatnonzero(drawn)
    if not len(which):
        return Image.new("RGB", (1, 1), (255, 255, 255))
    low, high = corners[which].min((0, 1))[:2], corners[which].max((0, 1))[:2]
    pixel_m = max(pixel_m, float((high - low).max()) / LARGEST_PIXELS)
    width, height = (int(n) for n in np.ceil((high - low) / pixel_m) + 1)
    depth = np.full(width * height, -np.inf)
    color = np.tile(np.asarray(BACKGROUND), (width * height, 1))
    for batch in _batches(corners[which], which, pixel_m):
        _draw(geometry, corners[batch], batch, (low, pixel_m, width, cut_m), depth, color)
    shaded = _shade(depth.reshape(height, width), color.reshape(height, width, 3), pixel_m)
    section = project_slab(corners[corners[..., 2].max(1) > cut_m], cut_m - 0.01, cut_m)
    corner = (float(low[0]) - pixel_m / 2, float(low[1]) - pixel_m / 2)
    shaded[rasterise(section, corner, (width, height), pixel_m).T] = CUT_COLOR
    return Image.fromarray((255 * np.clip(shaded, 0, 1) ** (1 / 2.2)).astype(np.uint8)[::-1])


def png(picture: Image.Image) -> bytes:
    """The picture as the bytes of a PNG file."""
    buffer = io.BytesIO()
    picture.quantize(255, dither=Image.Dither.NONE).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def _is_upright(corners: Floats) -> npt.NDArray[np.bool_]:
    """Return a mask of the triangles that are seen edge-on from above."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    upright: npt.NDArray[np.bool_] = np.abs(normal[:, 2]) <= 0.02 * np.linalg.norm(normal, axis=1)
    return upright


def _batches(corners: Floats, which: npt.NDArray[np.int64], pixel_m: float) -> list[npt.NDArray[np.int64]]:
    sides_m = np.linalg.norm(corners - np.roll(corners, -1, 1), axis=2)
    area_m2 = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    points = area_m2 / pixel_m**2 + sides_m.sum(1) / pixel_m + 3
    part = (np.cumsum(2 * points) // BATCH_POINTS).astype(np.int64)
    return [which[part == number] for number in range(int(part.max()) + 1) if (part == number).any()]


def _draw(
    geometry: SceneGeometry,
    corners: Floats,
    batch: npt.NDArray[np.int64],
    view: tuple[Floats, float, int, float],
    depth: Floats,
    color: Floats,
) -> None:
    low, pixel_m, width, cut_m = view
    points, local = surface_points(corners, 0.7 * pixel_m)
    below = points[:, 2] <= cut_m
    points, local = points[below], local[below]
    pixels = np.rint((points[:, :2] - low) / pixel_m).astype(np.int64)
    index = pixels[:, 1] * width + pixels[:, 0]
    # The highest point of each pixel comes last.
    order = np.argsort(points[:, 2], kind="stable")
    best = np.full(len(depth), -1, np.int64)
    best[index[order]] = order
    pixel = np.flatnonzero(best >= 0)
    winner = best[pixel]
    higher = points[winner, 2] > depth[pixel]
    pixel, winner = pixel[higher], winner[higher]
    depth[pixel] = points[winner, 2]
    color[pixel] = _surface_color(geometry, corners, points[winner], local[winner], batch)


def _surface_color(
    geometry: SceneGeometry, corners: Floats, points: Floats, local: npt.NDArray[np.int64], batch: npt.NDArray[np.int64]
) -> Floats:
    """Base colour at points of triangles, in the light of a bright sky."""
    triangle = batch[local]
    first, second, third = corners[local].transpose(1, 0, 2)
    normal = np.cross(second - first, third - first)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    normal *= np.where(normal[:, 2:] < 0, -1.0, 1.0)
    weights = _barycentric(points, first, second, third)
    uv = (geometry.uvs[geometry.triangles[triangle]] * weights[..., None]).sum(1)
    material = geometry.triangle_material[triangle]
    color = np.array([material.base_color for material in geometry.materials], np.float64)[material]
    for number in np.unique(material):
        image_number = geometry.materials[number].base_color_image
        if image_number is None:
            continue
        image, mine = geometry.images[image_number], material == number
        size = np.array([image.shape[1], image.shape[0]])
        texel = np.floor((uv[mine] % 1.0) * size).astype(np.int64) % size
        color[mine] *= (image[texel[:, 1], texel[:, 0], :3] / 255.0) ** 2.2
    sky = 0.55 + 0.45 * normal[:, 2]
    light = 0.35 * np.clip(normal @ (TOWARDS_LIGHT / np.linalg.norm(TOWARDS_LIGHT)), 0, 1)
    lit: Floats = color * (sky + light)[:, None]
    return lit


def _barycentric(points: Floats, first: Floats, second: Floats, third: Floats) -> Floats:
    b, c, p = second - first, third - first, points - first
    bb, bc, cc, pb, pc = ((u * v).sum(1) for u, v in ((b, b), (b, c), (c, c), (p, b), (p, c)))
    determinant = bb * cc - bc * bc
    safe = np.where(np.abs(determinant) < 1e-18, 1.0, determinant)
    v = np.where(np.abs(determinant) < 1e-18, 0.0, (cc * pb - bc * pc) / safe)
    w = np.where(np.abs(determinant) < 1e-18, 0.0, (bb * pc - bc * pb) / safe)
    return np.stack([1 - v - w, v, w], 1)


def _shade(depth: Floats, color: Floats, pixel_m: float) -> Floats:
    """Darken what lies beside something higher, at two scales: ambient occlusion of a height field."""
    empty = ~np.isfinite(depth)
    floor = float(depth[~empty].min())
    heights = np.where(empty, floor, depth)
    shade = np.ones_like(heights)
    for radius_m, strength in ((0.08, 0.35), (0.35, 0.45)):
        around = ndimage.gaussian_filter(np.maximum(heights, floor), radius_m / pixel_m)
        shade *= 1.0 - strength * np.clip((around - heights) / 0.6, 0.0, 1.0)
    shade[empty] = 1.0
    shaded: Floats = color * shade[..., None]
    return shaded
