"""How much our pictures are like photos: objects that a photo-trained detector finds, features, and statistics.

python -m benchmarks realism --weights package/models/centernet.json [--only NAME:VARIANT ...] [--views 6]
    [--times day evening night] [--width 960] [--score 0.3] [--quality fast] [--device cuda] [--cache FOLDER]
    [--json FILE] [--markdown FILE] [--pictures FOLDER]

Pictures are 16 : 9 and 90° wide, at poses of each environment's trajectory (`views.median_places`), in the light
of docs/gallery.md. The detector (`detection`) was trained on COCO's photos and on none of ours; without --weights the
error says what fetches it. An object is found by a detection of its class, of --score or more, whose box overlaps that
of its pixels with an IoU of 0.5 (and 0.3). It counts when it shows 1,000 pixels or more, half or more of those that it
would show if nothing hid it and the picture had no edge; the rest need not be found, and finding it is no error. A
group, such as a stack of books, is found by one of its things, and a sink, of which BEAR's box is that of the cabinet
and COCO's that of the basin, by a detection inside. Classes are those of BEAR, all of which COCO has; detections of
others do not count.

Features (`picture_statistics`): those of a view beside those of a second one, 10 cm to its left and turned by 10°.
Repeatability is the share of features in both views that are found again within 3 pixels (Schmid et al., IJCV 37(2),
2000), right matches the share of those matches that are within as much.
"""

import argparse
import json
import sys
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot.core.declarations.catalog import Declaration
from benchbot.core.errors import BenchbotError
from benchbot.mapping import CLASS_LIST
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import _ti
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.quality import REALTIME
from benchbot_sim_taichi.renderer import Frame, Intrinsics, Renderer
from benchmarks import views
from benchmarks.bench_fidelity import QUALITIES
from benchmarks.boxes import Box, Truth
from benchmarks.detection import SAME_CLASS, Detector
from benchmarks.picture_statistics import compare_views, statistics_of
from benchmarks.realism_pictures import add_misses, save_drawn, save_misses
from benchmarks.realism_tables import Row, line, markdown

LEAST_PIXELS = 1000
LEAST_SHOWN = 0.5
STEP_M, TURN_DEG = 0.1, 10.0
NEAREST_M = 0.05
OUTLINE_PIXELS = 800
COCO_OUTLINES_A_PART = {"sink"}
"""BEAR's box is that of the cabinet, COCO's that of the basin."""
DISTRIBUTION = "benchbot-envs-bear"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--weights", type=Path, default=Path("package/models/centernet.json"), metavar="FILE")
    parser.add_argument("--only", nargs="+", metavar="NAME:VARIANT", help="these environments; otherwise BEAR's")
    parser.add_argument("--times", nargs="+", choices=views.TIMES, default=["day"])
    parser.add_argument("--views", type=int, default=6, help="of each environment")
    parser.add_argument("--width", type=int, default=960)
    parser.add_argument("--score", type=float, default=0.3, help="the least at which a detection counts")
    parser.add_argument("--quality", choices=QUALITIES, default=REALTIME.name)
    parser.add_argument("--device", choices=_ti.DEVICES, default="cpu")
    parser.add_argument("--cache", type=Path, help="keep what is made of the scenes there")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write objects, detections and figures there")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="also write the tables there")
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="also write pictures with boxes, and misses")
    options = parser.parse_args()
    try:
        detector = Detector(options.weights)
    except BenchbotError as error:
        sys.exit(str(error))
    rows: list[Row] = []
    misses: dict[str, list[Image.Image]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        options.cache = options.cache or Path(folder)
        for name in options.only or of_bear():
            environment = views.declared(name)
            for at in options.times:
                for row, picture in measure(environment, at, detector, options):
                    rows.append(row)
                    if options.pictures:
                        save_drawn(row, picture, options.pictures)
                        add_misses(row, picture, misses)
                print(
                    line(f"{name} {at}", [row for row in rows if (row.environment, row.time) == (name, at)]), flush=True
                )
                if options.json:
                    written = json.dumps([asdict(row) for row in rows], indent=1)
                    options.json.write_text(written + "\n", encoding="utf-8")
    for class_name, pictures in misses.items():
        save_misses(pictures, options.pictures / f"misses-{class_name.replace(' ', '_')}.jpg")
    tables = "\n".join(markdown(rows))
    print(f"\n{tables}")
    if options.markdown:
        options.markdown.write_text(tables + "\n", encoding="utf-8")


def of_bear() -> list[str]:
    """Names of the simulated environments that BEAR describes."""
    return [name for name in views.shipped() if views.declared(name).distribution == DISTRIBUTION]


def measure(
    environment: Declaration, at: str, detector: Detector, options: argparse.Namespace
) -> Iterator[tuple[Row, npt.NDArray[np.uint8]]]:
    """Each view of an environment at one time of day, and its picture."""
    scene = views.scene_of(environment, options.cache)
    places = views.median_places(environment, scene, options.cache, options.device, options.views)
    camera = Intrinsics.from_horizontal_fov(options.width, options.width * 9 // 16, 90.0)
    lighting = Lighting.from_mapping(views.light_at(at, environment.data.get("lighting") or {}))
    quality = QUALITIES[options.quality]
    renderer = Renderer(scene, lighting, cache_dir=options.cache, device=options.device, quality=quality)
    for view, pose in enumerate(views.camera_poses(environment)[places]):
        yield look(renderer, pose, camera, detector, options.score, (environment.name, at, view))


def look(
    renderer: Renderer,
    pose: npt.NDArray[np.float64],
    camera: Intrinsics,
    detector: Detector,
    least_score: float,
    name: tuple[str, str, int],
) -> tuple[Row, npt.NDArray[np.uint8]]:
    """Return the row of a view, with its name: environment, time and number; and its picture."""
    beside = pose @ step_aside()
    frame, other = renderer.render(pose, camera), renderer.render(beside, camera)
    found = [
        replace(each, class_name=SAME_CLASS.get(each.class_name, each.class_name))
        for each in detector.detect(frame.rgb, least_score)
    ]
    row = Row(
        *name,
        tuple(truths(renderer.scene, frame, pose, camera)),
        tuple(each for each in found if each.class_name in CLASS_LIST),
        compare_views(frame, other, (pose, beside), camera),
        statistics_of(frame.rgb),
    )
    return row, frame.rgb


def step_aside() -> npt.NDArray[np.float64]:
    """Where the second view is, in the optical frame of the first: to its left, and turned to the left."""
    angle = np.radians(TURN_DEG)
    moved = np.eye(4)
    moved[:3, :3] = [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    moved[0, 3] = -STEP_M
    return moved


def truths(scene: SceneGeometry, frame: Frame, pose: npt.NDArray[np.float64], camera: Intrinsics) -> Iterator[Truth]:
    """Yield each object of BEAR's classes that a picture shows, with the box of its pixels."""
    for instance in scene.instances:
        is_it = frame.instance == instance.index
        if instance.class_name not in CLASS_LIST or not is_it.any():
            continue
        box = box_of(is_it)
        pixels = int(is_it.sum())
        shown = 0.0
        if pixels >= LEAST_PIXELS:
            corners = scene.vertices[scene.triangles[scene.triangle_instance == instance.index]]
            shown = pixels / max(whole_pixels(corners, pose, camera), 1.0)
        by_part = instance.is_group or instance.class_name in COCO_OUTLINES_A_PART
        yield Truth(instance.class_name, pixels, box, shown >= LEAST_SHOWN, by_part)


def box_of(is_it: npt.NDArray[np.bool_]) -> Box:
    """The smallest box around the pixels (H, W) that are true, of which there is one."""
    (rows,), (columns,) = np.nonzero(is_it.any(axis=1)), np.nonzero(is_it.any(axis=0))
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)


def whole_pixels(corners: npt.NDArray[np.floating], pose: npt.NDArray[np.float64], camera: Intrinsics) -> float:
    """Pixels of triangles (T, 3, 3) on an endless picture with nothing before them; infinity behind the camera."""
    in_camera = (corners - pose[:3, 3]) @ pose[:3, :3]
    if in_camera[..., 2].min() < NEAREST_M:
        return np.inf
    at = in_camera[..., :2] / in_camera[..., 2:] * [camera.fx, camera.fy]
    at -= at.min(axis=(0, 1))
    scale = OUTLINE_PIXELS / at.max()
    filled = np.zeros((OUTLINE_PIXELS + 1, OUTLINE_PIXELS + 1), np.uint8)
    for triangle in np.rint(at * scale).astype(np.int32):
        cv2.fillConvexPoly(filled, triangle, 1)
    return float(filled.sum() / scale**2)


if __name__ == "__main__":
    main()
