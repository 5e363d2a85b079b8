"""Senses against each other and against ground truth, in any scene: nothing need be known but what the checks name.

Pure functions of observations, of the robot's declaration (its calibration) and of the ground truth.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchbot.core.findings import Finding, Level
from benchbot.evaluation.occupancy_map import OccupancyMap
from benchbot.plugins.authoring.comparability import agreement, faults, labels
from benchbot.plugins.authoring.comparability.agreement import explain
from benchbot.plugins.authoring.comparability.senses import Picture, Scan, Sight, laser_scans, pictures
from benchbot.plugins.authoring.comparability.world import Floats, World

LEAST_INSIDE, FULL_INSIDE = 0.9, 0.97
LEAST_AS_LASER, FULL_AS_LASER = 0.6, 0.7
LEAST_ON_MAP = 0.85
FEWEST = 30
"""Fewer pixels or beams than these tell nothing."""
BOX_TOLERANCE_M, LASER_TOLERANCE_M, SAME_HEIGHT_M = 0.05, 0.05, 0.04
BESIDE_M = 0.05
"""A pixel further than this beside the nearest beam is not compared with it."""
MAP_TOLERANCE_CELLS = 2


def check_boxes(sights: Sequence[Sight], robot: Mapping[str, Any], world: World) -> Iterator[Finding]:
    """Yield the finding on whether labelled pixels, through depth, intrinsics and pose, lie in boxes of their class."""
    depths, segments = pictures(sights, "image_depth", robot), pictures(sights, "image_segment", robot)
    if not depths or len(depths) != len(segments) or depths[0].values.shape != segments[0].values.shape[:2]:
        return
    numbers = {number: name for name, number in labels.class_ids(sights).items()}
    # The label travels with the depth, through all that may be wrong with the camera.
    seen = [agreement.with_labels(depth, one.values[..., 0]) for depth, one in zip(depths, segments, strict=True)]

    def score(looked: Sequence[Picture]) -> float:
        inside, labelled = 0, 0
        for one in looked:
            depth_m, classes = one.values[..., 0], one.values[..., 1]
            points = replace(one, values=depth_m).points().reshape(-1, 3)
            for number in set(classes[classes > 0].astype(int).tolist()):
                of_class = [at for at, box in enumerate(world.boxes) if box.class_name == numbers.get(number)]
                pixels = (classes == number).ravel() & np.isfinite(depth_m).ravel()
                labelled += int(pixels.sum())
                if of_class and pixels.any():
                    inside += int(np.sum(world.distances_m(points[pixels])[:, of_class].min(1) <= BOX_TOLERANCE_M))
        return inside / labelled if labelled >= FEWEST else 1.0

    def known() -> Iterator[faults.Fault]:
        yield from faults.camera_faults()
        yield from faults.of_first_layer(faults.depth_faults())
        yield from faults.shift_faults(score, [one.thinned() for one in seen])
        yield from (*faults.frame_faults("camera", [one.base.matrix() for one in sights], ()), *faults.scene_faults())

    explained = explain(seen, score, known, FULL_INSIDE)
    subject = "image_depth, image_segment: boxes"
    yield agreement.finding(subject, explained, LEAST_INSIDE, "labelled pixels, in boxes of their class,")


def check_laser(sights: Sequence[Sight], robot: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield the finding on whether depth and laser see the same: points of a picture at the height of the laser."""
    depths, scans = pictures(sights, "image_depth", robot), laser_scans(sights, robot)
    if len(depths) != len(scans) or not depths:
        return
    # What a laser at the height of the floor hits, no camera sees as that: it sees the floor.
    low = any(
        scan.origin[2] - sight.base.translation_xyz[2] <= SAME_HEIGHT_M
        for scan, sight in zip(scans, sights, strict=True)
    )
    if low or _as_laser(depths, scans) is None:
        yield Finding(Level.OK, "image_depth, laser", "the camera sees nothing at the height of the laser")
        return

    def of_depths(looked: Sequence[Picture]) -> float:
        return _as_laser(looked, scans) or 0.0

    def of_scans(looked: Sequence[Scan]) -> float:
        return _as_laser(depths, looked) or 0.0

    def cameras() -> Iterator[faults.Fault]:
        yield from (*faults.camera_faults(), *faults.depth_faults())

    explained = explain(depths, of_depths, cameras, FULL_AS_LASER)
    if explained.fault is None or explained.undone < LEAST_AS_LASER:
        other = explain(scans, of_scans, faults.scan_faults, FULL_AS_LASER)
        explained = other if other.undone > explained.undone else explained
    yield agreement.finding("image_depth, laser", explained, LEAST_AS_LASER, "what both see at the laser's height")


def check_map(sights: Sequence[Sight], robot: Mapping[str, Any], floor: OccupancyMap) -> Iterator[Finding]:
    """Yield the finding on whether the beams of the laser end where the map has something."""
    scans = laser_scans(sights, robot)
    reach = np.arange(-MAP_TOLERANCE_CELLS, MAP_TOLERANCE_CELLS + 1) * floor.resolution_m

    def score(looked: Sequence[Scan]) -> float:
        ended = np.concatenate([scan.points()[np.isfinite(scan.values), :2] for scan in looked])
        near = np.zeros(len(ended), bool)
        for x in reach:
            for y in reach:
                near |= floor.at(floor.occupied, ended + np.array([x, y]))
        return float(near.mean()) if len(ended) >= FEWEST else 1.0

    if scans:
        explained = explain(scans, score, faults.scan_faults)
        yield agreement.finding("laser: map", explained, LEAST_ON_MAP, "beams, ending where the map has something,")


def _as_laser(depths: Sequence[Picture], scans: Sequence[Scan]) -> float | None:
    """Return the share of pixels at the laser's height that are where its beams end; None where there are too few."""
    same, looked_at = 0, 0
    for depth, scan in zip(depths, scans, strict=True):
        points = depth.points()[np.isfinite(depth.values)]
        in_frame = (points - scan.origin) @ scan.pose[:3, :3]
        level = in_frame[np.abs(in_frame[:, 2]) <= SAME_HEIGHT_M]
        distances_m = np.hypot(level[:, 0], level[:, 1])
        ranges_m, aside_rad = _beams_at(scan, level)
        low_m, high_m = scan.limits_m
        counts = (distances_m >= low_m) & (distances_m <= high_m) & (distances_m * aside_rad <= BESIDE_M)
        off_m = np.abs(ranges_m - distances_m)
        same += int(np.sum(off_m[counts] <= LASER_TOLERANCE_M + agreement.TOLERANCE_SHARE * distances_m[counts]))
        looked_at += int(counts.sum())
    return same / looked_at if looked_at >= FEWEST else None


def _beams_at(scan: Scan, points: Floats) -> tuple[Floats, Floats]:
    """Return the range (N,) of the beam nearest to the direction of each point, and the angle between the two."""
    angles_rad = np.arctan2(scan.along[:, 1], scan.along[:, 0])
    towards_rad = np.arctan2(points[:, 1], points[:, 0])
    order = np.argsort(angles_rad)
    after = np.searchsorted(angles_rad[order], towards_rad)
    beside = order[(after[:, None] + np.array([-1, 0])) % len(order)]
    aside_rad = np.abs(np.angle(np.exp(1j * (angles_rad[beside] - towards_rad[:, None]))))
    nearest = np.argmin(aside_rad, axis=1)[:, None]
    ranges_m: Floats = scan.values[np.take_along_axis(beside, nearest, 1)[:, 0]]
    return ranges_m, np.take_along_axis(aside_rad, nearest, 1)[:, 0]
