"""The mapping from a session's steps to Rerun's archetypes, by the paths of their entities."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import rerun
from numpy.typing import NDArray

from benchbot.plugin import (
    BenchbotError,
    Catalog,
    GroundTruths,
    LaserScan,
    LidarScan,
    Observations,
    Step,
    load_plugins,
)

MAP = "map"
CAMERA, LASER_FRAME, BASE = "camera", "lidar", "base_link"
JPEG_QUALITY = 92
MOST_POINTS = 1000
POINT_RADIUS_M = 0.02
TRUTH_FORMAT = "object_map_ground_truth"
TRUTH, ESTIMATE = (255, 236, 160), (120, 215, 255)

Entity = tuple[str, Any]


class Way:
    """The path of the robot as the solution observed it; a long one is thinned to every n-th position."""

    def __init__(self) -> None:
        self._places: list[tuple[float, ...]] = []

    def to(self, place: tuple[float, ...]) -> list[tuple[float, ...]]:
        """Append a position; return the thinned path up to it."""
        if self._places[-1:] != [place]:
            self._places.append(place)
        stride = -(-len(self._places) // MOST_POINTS)
        return [*self._places[:-1:stride], place]


def entities_of(action: str | None, arguments: Mapping[str, float], step: Step, way: Way) -> Iterator[Entity]:
    """Yield (path, archetype) of everything to record of one step. Poses are those that the solution observed."""
    seen = step.observations
    poses = seen.get("poses", {})
    if action is not None:
        told = ", ".join(f"{name} {_told(value)}" for name, value in arguments.items())
        yield "actions", rerun.TextLog(f"{action} {told}: {step.outcome}, {step.result}".replace(" :", ":"))
    yield "state", rerun.TextLog(f"{step.state}, scene {step.scene_number + 1}")
    for name, pose in poses.items():
        placed = rerun.Transform3D(
            translation=pose["translation_xyz"], rotation=rerun.Quaternion(xyzw=pose["rotation_xyzw"])
        )
        yield f"{MAP}/{name}", placed
    if BASE in poses:
        base = tuple(float(value) for value in poses[BASE]["translation_xyz"])
        yield f"{MAP}/way", rerun.LineStrips3D([way.to(base)], radii=POINT_RADIUS_M)
    if "joint_states" in seen:
        joints = seen["joint_states"]
        for name, position in zip(joints["names"], joints["positions"], strict=True):
            yield f"joints/{name}", rerun.Scalars(float(position))
    yield from _of_camera(seen)
    if "laser" in seen:
        yield f"{MAP}/{LASER_FRAME}/scan", _points(_beams(seen["laser"]))
    if "lidar" in seen:
        yield f"{MAP}/{seen['lidar']['frame_id']}/points", _points(_rings(seen["lidar"]))


def _told(value: Any) -> str:
    """Return an argument in words: a number, or several."""
    return f"[{', '.join(f'{each:g}' for each in value)}]" if isinstance(value, list | tuple) else f"{value:g}"


def boxes_of(results: Any) -> Iterator[Entity]:
    """Yield the boxes of an object map, with the likeliest class of each and its probability; none of other results."""
    objects = results.get("objects") if isinstance(results, dict) else None
    known = [item for item in objects or () if {"centroid", "extent"} <= item.keys()]
    if known:
        names = results.get("class_list", ())
        yield (
            f"{MAP}/objects",
            rerun.Boxes3D(
                centers=[item["centroid"] for item in known],
                sizes=[item["extent"] for item in known],
                labels=[_likeliest(item.get("label_probs", ()), names) for item in known],
                colors=ESTIMATE,
            ),
        )


def truth_of(run: Mapping[str, Any]) -> Iterator[Entity]:
    """Yield the true boxes of the last scene of a run, with their classes; nothing where they are not known.

    Those of a hidden place are never told, nor those of a run with a secret.
    """
    if run["selection"].get("commitment") is not None or not run["environments"]:
        return
    scene = run["environments"][-1]
    name = f"{scene['name']}:{scene['variant']}"
    catalog = Catalog(load_plugins())
    declared = catalog.find("environments", name)
    if declared is None or declared.data.get("hidden"):
        return
    try:
        truth = GroundTruths.of(catalog, None).find(name, {TRUTH_FORMAT})["ground_truth"]["objects"]
    except BenchbotError:
        return
    yield (
        f"{MAP}/truth",
        rerun.Boxes3D(
            centers=[item["centroid"] for item in truth],
            sizes=[item["extent"] for item in truth],
            labels=[item["class"] for item in truth],
            colors=TRUTH,
            show_labels=False,
        ),
    )


def _likeliest(weights: Sequence[float], names: Sequence[str]) -> str:
    place = max(range(len(weights)), key=weights.__getitem__, default=len(names))
    return f"{names[place]} {weights[place]:.2f}" if place < len(names) else "object"


def _of_camera(seen: Observations) -> Iterator[Entity]:
    camera = f"{MAP}/{CAMERA}"
    model = seen.get("image_rgb_info") or seen.get("image_depth_info") or seen.get("image_segment_info")
    if model is not None:
        yield (
            f"{camera}/image",
            rerun.Pinhole(
                image_from_camera=np.reshape(model["matrix_intrinsics"], (3, 3)),
                resolution=[model["width"], model["height"]],
            ),
        )
    if "image_rgb" in seen:
        yield f"{camera}/image/rgb", rerun.Image(seen["image_rgb"]).compress(jpeg_quality=JPEG_QUALITY)
    if "image_depth" in seen:
        yield f"{camera}/image/depth", rerun.DepthImage(seen["image_depth"], meter=1.0)
    if "image_segment" in seen:
        segment = seen["image_segment"]
        names = [(number, name) for name, number in segment["class_ids"].items()]
        yield f"{camera}/image/classes", rerun.AnnotationContext(names)
        yield f"{camera}/image/classes", rerun.SegmentationImage(segment["class_segment_img"])
        yield f"{camera}/image/instances", rerun.SegmentationImage(segment["instance_segment_img"])


def _beams(laser: LaserScan) -> NDArray[Any]:
    ranges_m, angles_rad = np.asarray(laser["scans"], float).reshape(-1, 2).T
    return np.stack([ranges_m * np.cos(angles_rad), ranges_m * np.sin(angles_rad), np.zeros(len(ranges_m))], 1)


def _rings(lidar: LidarScan) -> NDArray[Any]:
    ranges_m = np.asarray(lidar["ranges_m"], float)
    elevations_rad = np.asarray(lidar["elevations_rad"], float)[:, None]
    azimuths_rad = np.asarray(lidar["azimuths_rad"], float)[None, :]
    flat = ranges_m * np.cos(elevations_rad)
    place = (flat * np.cos(azimuths_rad), flat * np.sin(azimuths_rad), ranges_m * np.sin(elevations_rad))
    return np.stack(place, -1).reshape(-1, 3)


def _points(places: NDArray[Any]) -> Any:
    return rerun.Points3D(places[np.isfinite(places).all(1)], radii=POINT_RADIUS_M)
