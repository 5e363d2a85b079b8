"""One function for each kind of observation: draws it into matplotlib axes, with the titles of BenchBot v2."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.core.channels import LaserScan, LidarScan, Segmentation

TRIAD_M = 0.25
STRIPES = 7
# Multiples of it, modulo 1, are far from each other, however many there are.
GOLDEN_RATIO = (math.sqrt(5) - 1) / 2
# Depth that is invalid or out of range is drawn in a colour that the map "hot" does not have.
INVALID_DEPTH = "slategrey"
COMPASS = (("x", "r"), ("y", "g"), ("z", "b"))


def draw_rgb(axes: Any, image: NDArray[np.uint8]) -> None:
    """Draw a colour image (H, W, 3)."""
    axes.imshow(image)
    _as_image(axes, "image_rgb")


def draw_depth(axes: Any, depth_m: NDArray[np.float32]) -> None:
    """Draw a depth image (H, W) from the nearest, dark, to the farthest, bright; pixels without depth in grey."""
    from matplotlib import colormaps

    valid = np.ma.masked_invalid(depth_m)
    low, high = (valid.min(), valid.max()) if valid.count() else (0.0, 1.0)
    cmap = colormaps["hot"].with_extremes(bad=INVALID_DEPTH)
    drawn = axes.imshow(valid, cmap=cmap, vmin=low, vmax=high, interpolation="nearest")
    drawn.format_cursor_data = lambda value: f"[{value:.2f} m]"
    _as_image(axes, "image_depth")


def draw_classes(axes: Any, segments: Segmentation) -> None:
    """Draw the class of each pixel; a pixel without a class is black."""
    axes.imshow(_colors(segments["class_segment_img"], "gist_rainbow"), interpolation="nearest")
    _as_image(axes, "image_class")


def draw_instances(axes: Any, segments: Segmentation) -> None:
    """Draw each object in diagonal stripes: of the colour of its class, and of that of its number in the class."""
    classes, instances = segments["class_segment_img"], segments["instance_segment_img"]
    striped = _stripes(instances)[..., None]
    by_class, by_number = _colors(classes, "gist_rainbow"), _colors(instances % 1000, "brg")
    axes.imshow(np.where(striped, by_class, by_number), interpolation="nearest")
    _as_image(axes, "image_instance")


def draw_laser(axes: Any, laser: LaserScan) -> None:
    """Draw the ends of the beams in the scanner's frame, metres; beams that met nothing are left out."""
    ranges_m, angles_rad = np.asarray(laser["scans"], np.float64).reshape(-1, 2).T
    met = np.isfinite(ranges_m)
    ranges_m, angles_rad = ranges_m[met], angles_rad[met]
    axes.scatter(ranges_m * np.cos(angles_rad), ranges_m * np.sin(angles_rad), c="k", s=4, marker="s")
    axes.plot(0, 0, c="r", marker=">")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("laser (robot frame)")


def draw_lidar(axes: Any, lidar: LidarScan) -> None:
    """Draw the ranges by direction, from the nearest, dark, to the farthest, bright; missing ones in grey.

    Rings by elevation, the highest on top; ahead in the middle, the left on the left.
    """
    from matplotlib import colormaps

    elevations_deg, azimuths_deg = np.degrees(lidar["elevations_rad"]), np.degrees(lidar["azimuths_rad"])
    rows, columns = np.argsort(-elevations_deg), np.argsort(-azimuths_deg)
    ranges_m = np.ma.masked_invalid(np.asarray(lidar["ranges_m"])[rows][:, columns])
    low, high = (ranges_m.min(), ranges_m.max()) if ranges_m.count() else (0.0, 1.0)
    axes.imshow(
        ranges_m,
        cmap=colormaps["viridis"].with_extremes(bad=INVALID_DEPTH),
        vmin=low,
        vmax=high,
        aspect="auto",
        interpolation="nearest",
    )
    axes.set_yticks((0, len(rows) - 1), [f"{elevations_deg[row]:+.0f}°" for row in (rows[0], rows[-1])])
    axes.set_xticks([])
    axes.set_title("lidar (ranges)")


def draw_poses(axes: Any, poses: Mapping[str, Any]) -> None:
    """Draw the frames, each as three arrows along its x (red), y (green) and z (blue), in the map frame, metres."""
    origin = {"translation_xyz": np.zeros(3), "rotation_xyzw": np.array([0.0, 0.0, 0.0, 1.0])}
    places = []
    for name, pose in _distinct({"map": origin, **poses}):
        place = np.asarray(pose["translation_xyz"], np.float64)
        for axis, (_, color) in zip(_axes_of(pose["rotation_xyzw"]), COMPASS, strict=True):
            axes.quiver(*place, *axis, length=TRIAD_M, color=color)
        axes.text(*place, name, fontsize="small")
        places += [place - TRIAD_M, place + TRIAD_M]
    set_axes_equal(axes, np.array(places))
    axes.set_title("poses (world frame)")


def set_axes_equal(axes: Any, points: NDArray[np.float64]) -> None:
    """Give three axes one scale, and limits that show all points (N, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, radius = (low + high) / 2, max(float((high - low).max()) / 2, TRIAD_M)
    axes.set(
        **{f"{name}lim": (middle[i] - radius, middle[i] + radius) for i, (name, _) in enumerate(COMPASS)},
        **{f"{name}label": f"{name} (m)" for name, _ in COMPASS},
        box_aspect=(1, 1, 1),
    )


def _as_image(axes: Any, title: str) -> None:
    axes.set(xticks=[], yticks=[], title=title)


def _colors(numbers: NDArray[Any], cmap: str) -> NDArray[np.uint8]:
    """Return an image (H, W, 3) in which each number has a colour of its own, the same in every image; 0 is black."""
    from matplotlib import colormaps

    places = np.arange(int(numbers.max(initial=0)) + 1) * GOLDEN_RATIO % 1
    colors: NDArray[np.uint8] = (colormaps[cmap](places)[:, :3] * 255).astype(np.uint8)
    colors[0] = 0
    image: NDArray[np.uint8] = colors[numbers]
    return image


def _stripes(instances: NDArray[np.uint16]) -> NDArray[np.bool_]:
    """Return diagonal stripes (H, W), as wide as suits the size of each instance."""
    striped = np.zeros(instances.shape, bool)
    for number in np.unique(instances[instances > 0]):
        rows, columns = np.nonzero(instances == number)
        width = max(1, math.ceil(min(np.ptp(rows), np.ptp(columns)) / STRIPES))
        striped[rows, columns] = (rows + columns) // width % 2 == 0
    return striped


def _distinct(poses: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the poses with their names; names of one and the same pose are joined."""
    joined: dict[bytes, tuple[str, Mapping[str, Any]]] = {}
    for name, pose in poses.items():
        numbers = np.concatenate([np.ravel(pose["translation_xyz"]), np.ravel(pose["rotation_xyzw"])])
        key = (np.round(numbers, 6) + 0.0).tobytes()
        names = f"{joined[key][0]}, {name}" if key in joined else name
        joined[key] = names, pose
    return list(joined.values())


def _axes_of(rotation_xyzw: Sequence[float]) -> NDArray[np.float64]:
    """Return the unit vectors of a frame rotated by a unit quaternion, one a row (3, 3)."""
    *vector, w = np.asarray(rotation_xyzw, np.float64)
    turned = np.cross(vector, np.eye(3))
    axes: NDArray[np.float64] = np.eye(3) + 2 * (w * turned + np.cross(vector, turned))
    return axes
