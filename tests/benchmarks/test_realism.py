"""Objects are counted by the stated rule, in made-up pictures and in one of the miniroom with a made-up detector."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks import bench_realism, views
from benchmarks.bench_realism import box_of, look, of_bear, whole_pixels
from benchmarks.boxes import Detection, Truth
from benchmarks.detection import SCALES, Detector
from benchmarks.picture_statistics import FeatureFigures, PictureStatistics
from benchmarks.realism_pictures import add_misses, save_drawn, save_misses
from benchmarks.realism_tables import Count, Row, count, counts, markdown, no_table, picture_figures, whole_only
from tests.benchmarks import made_detector

CAMERA = Intrinsics.from_horizontal_fov(100, 100, 90.0)
FIGURES = {"ORB": FeatureFigures(10, 8, 6, 3)}
STATISTICS = PictureStatistics(1.2, 0.2, 0.01, 0.0)
ROW = Row(
    "a:1",
    "day",
    0,
    (
        Truth("cup", 1500, (0.0, 0.0, 50.0, 40.0)),
        Truth("table", 9000, (0.0, 50.0, 100.0, 200.0)),
        Truth("cup", 500, (200.0, 0.0, 230.0, 30.0), is_counted=False),
    ),
    (
        Detection("cup", 0.9, (0.0, 0.0, 50.0, 40.0)),
        Detection("cup", 0.5, (200.0, 0.0, 230.0, 30.0)),
        Detection("chair", 0.4, (0.0, 50.0, 100.0, 200.0)),
    ),
    FIGURES,
    STATISTICS,
)


def test_found_missed_and_wrong_are_counted_by_class_and_size() -> None:
    assert count(ROW, 0.5) == Count(objects=2, found=1, wrong=1)
    assert count(ROW, 0.5, no_table) == Count(objects=1, found=1, wrong=1)
    assert count(ROW, 0.5, lambda class_name, pixels: pixels < 4000) == Count(objects=1, found=1)
    both = counts([ROW, ROW])
    assert (both.recall, both.precision) == (0.5, 0.5)
    assert math.isnan(Count().recall)
    assert math.isnan(Count().precision)


def test_tables_name_classes_sizes_lights_and_environments() -> None:
    lines = list(markdown([ROW]))
    for name in ("all", "all but tables", "1,000 to 4,000 pixels", "more", "day", "cup", "`a:1`"):
        assert any(line.startswith(f"| {name} |") for line in lines), name
    assert "| cup | 1 | 1 | 1.00 | 1.00 | 1.00 | 0 | 1.00 |" in lines
    assert not any(line.startswith("| night |") for line in lines)
    assert len({line.count("|") for line in lines if line.startswith(("| cup", "| all"))}) == 1
    assert picture_figures([ROW])["ORB right"] == 0.5


def test_what_is_found_by_a_part_is_not_found_whole() -> None:
    row = replace(
        ROW,
        truths=(Truth("sink", 9000, (0.0, 0.0, 50.0, 100.0), by_part=True),),
        detections=(Detection("sink", 0.9, (0.0, 0.0, 50.0, 20.0)),),
    )
    assert count(row, 0.5) == Count(1, 1, 0)
    assert count(whole_only(row), 0.5) == Count(1, 0, 1)


def test_pictures_and_sheets_of_misses_are_written(tmp_path: Path) -> None:
    picture = np.full((240, 320, 3), 90, np.uint8)
    save_drawn(ROW, picture, tmp_path)
    misses: dict[str, list[Image.Image]] = {"table": []}
    add_misses(ROW, picture, misses)
    save_misses(misses["table"], tmp_path / "misses-table.jpg")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a_1-day-0.jpg", "misses-table.jpg"]


def test_a_square_has_so_many_pixels_wherever_it_is_and_no_end_of_them_behind_the_camera() -> None:
    """A square of 2 m, 4 m before the camera, has 25 pixels a side; hidden triangles behind it do not count twice."""
    square = np.array([[(-1, -1, 4), (1, -1, 4), (1, 1, 4)], [(-1, -1, 4), (1, 1, 4), (-1, 1, 4)]], float)
    both = np.concatenate([square, square * 1.5])
    beside, behind = np.eye(4), np.eye(4)
    beside[0, 3], behind[2, 3] = 9.0, 5.0
    for corners, pose in ((square, np.eye(4)), (square, beside), (both, np.eye(4))):
        assert whole_pixels(corners, pose, CAMERA) == pytest.approx(25**2, rel=0.01)
    assert whole_pixels(both, behind, CAMERA) == np.inf


def test_a_box_is_that_of_its_pixels() -> None:
    is_it = np.zeros((10, 20), bool)
    is_it[3:5, 7:12] = True
    assert box_of(is_it) == (7.0, 3.0, 12.0, 5.0)


def test_a_detector_finds_what_it_was_made_for(tmp_path: Path) -> None:
    """At a size that is no multiple of 32, so that the picture is padded."""
    picture = np.full((100, 150, 3), 60, np.uint8)
    picture[40:56, 80:96] = (255, 0, 0)
    found = Detector(made_detector.write(tmp_path)).detect(picture, 0.6)
    assert {each.class_name for each in found} == {made_detector.CLASS_NAME}
    left, top, right, bottom = found[0].box
    assert (left + right) / 2 == pytest.approx(88, abs=10)
    assert (top + bottom) / 2 == pytest.approx(48, abs=10)
    sizes = [2 * made_detector.HALF_PX / scale for scale in SCALES]
    assert any(right - left == pytest.approx(size) for size in sizes)


def test_a_view_of_the_miniroom_has_objects_and_features_that_are_where_truth_puts_them(
    tmp_path: Path, kernel_cache: Path
) -> None:
    environment = views.declared("miniroom:1")
    scene = views.scene_of(environment, kernel_cache)
    lighting = Lighting.from_mapping(environment.data.get("lighting") or {})
    renderer = Renderer(scene, lighting, cache_dir=kernel_cache)
    camera = Intrinsics.from_horizontal_fov(480, 270, 90.0)
    pose = views.camera_poses(environment)[views.median_places(environment, scene, kernel_cache, "cpu")[0]]
    row, picture = look(renderer, pose, camera, Detector(made_detector.write(tmp_path)), 0.5, ("miniroom:1", "day", 0))
    assert picture.shape == (270, 480, 3)
    assert row.truths
    assert all(0 <= left < right <= 480 and 0 <= top < bottom <= 270 for left, top, right, bottom in boxes(row))
    assert {each.class_name for each in row.detections} <= {"table"}
    for figures in row.features.values():
        assert figures.right > 0.6 * figures.matches > 0
    assert 0.5 < row.statistics.spectral_slope < 2.0


def boxes(row: Row) -> list[tuple[float, float, float, float]]:
    return [truth.box for truth in row.truths] + [each.box for each in row.detections]


def test_bear_has_25_environments() -> None:
    assert len(of_bear()) == 25


def test_who_has_no_weights_is_told_what_fetches_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["realism", "--weights", str(tmp_path / "none.json")])
    with pytest.raises(SystemExit, match="npm pack"):
        bench_realism.main()
