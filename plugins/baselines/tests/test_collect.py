"""Two places, one drawn by hand: collected undisturbed, killed and gone on with, read as COCO and as Parquet."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO

from benchbot.mapping import CLASS_LIST
from benchbot.plugin import BenchbotError
from benchbot_baselines.coco import runs
from benchbot_baselines.collecting import BACKGROUND, Settings, Shots, begin, place_file, read_shots, telling
from benchbot_baselines.command import collect

SEEDS = (9540, 9541)
VIEWS, WIDTH, HEIGHT = 2, 48, 32
COLLECT = (
    *(sys.executable, "-m", "benchbot", "collect", "--seeds", f"{SEEDS[0]}-{SEEDS[1]}", "--views", str(VIEWS)),
    *("--size", f"{WIDTH}x{HEIGHT}", "--quality", "fast", "--formats", "coco,parquet"),
    *("--device", "cpu", "--workers", "1", "--output-location"),
)


def drawn(folder: Path) -> Path:
    """Begin a collection with the first place, since another takes seconds: two boxes, of a chair and of no class."""
    begin(folder, Settings(VIEWS, WIDTH, HEIGHT, quality="fast"))
    instance = np.zeros((VIEWS, HEIGHT, WIDTH), np.uint16)
    instance[:, 4:20, 8:18], instance[:, 10:30, 30:40] = 1, 300
    classes = np.full(301, BACKGROUND, np.uint8)
    classes[1] = CLASS_LIST.index("chair")
    rgb = np.random.default_rng(0).integers(0, 256, (*instance.shape, 3), np.uint8)
    poses, cameras = np.stack([np.eye(4)] * VIEWS), np.tile([40.0, 40.0, 23.5, 15.5], (VIEWS, 1))
    shots = Shots(rgb, 1000 + instance, instance, classes, poses, cameras, np.array("day"))
    np.savez(place_file(folder, SEEDS[0]), **vars(shots))
    return folder


def collecting(folder: Path, cache: Path) -> "subprocess.Popen[str]":
    """Start collecting in a process of its own."""
    variables = {**os.environ, "BENCHBOT_CACHE_DIR": str(cache)}
    output = subprocess.PIPE
    return subprocess.Popen([*COLLECT, str(folder)], stdout=output, stderr=output, text=True, env=variables)


def collected(folder: Path, cache: Path) -> Path:
    """Collect to the end."""
    process = collecting(folder, cache)
    _, told = process.communicate()
    assert process.returncode == 0, told
    return folder


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def undisturbed(kernel_cache: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    kernels = {path.name for path in (kernel_cache / "kernels").glob("T*.tic")}
    folder = collected(drawn(tmp_path_factory.mktemp("collected") / "data"), kernel_cache)
    assert kernels
    assert {path.name for path in kernel_cache.rglob("T*.tic")} == kernels, "which runs have compiled"
    return folder


def test_pycocotools_reads_boxes_and_masks_of_the_objects_that_are_shown(undisturbed: Path) -> None:
    coco = COCO(undisturbed / "coco" / "instances.json")
    pictures = coco.loadImgs(coco.getImgIds())
    shots = {seed: read_shots(place_file(undisturbed, seed)) for seed in SEEDS}

    assert [picture["file_name"] for picture in pictures] == [
        f"{seed:06d}_{row:04d}.png" for seed in SEEDS for row in range(VIEWS)
    ]
    assert {annotation["image_id"] for annotation in coco.anns.values()} & set(coco.getImgIds()[VIEWS:])
    for number, picture in enumerate(pictures):
        seen, row = shots[picture["seed"]], number % VIEWS
        for one in coco.loadAnns(coco.getAnnIds(imgIds=picture["id"])):
            mask = coco.annToMask(one).astype(bool)
            rows, columns = np.nonzero(mask)
            assert (mask == (seen.instance[row] == one["instance"])).all()
            assert one["bbox"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
            assert coco.cats[one["category_id"]]["name"] == CLASS_LIST[seen.classes[one["instance"]]]


def test_datasets_reads_pictures_and_objects_by_split(
    undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")  # it would count downloads
    from datasets import load_dataset

    splits = load_dataset(str(undisturbed / "parquet"), cache_dir=str(tmp_path))

    assert {name: split["seed"][:] for name, split in splits.items()} == {
        "train": [SEEDS[1]] * VIEWS,
        "validation": [SEEDS[0]] * VIEWS,
    }
    for seed, rows in zip(SEEDS, (splits["validation"], splits["train"]), strict=True):
        seen = read_shots(place_file(undisturbed, seed))
        for number, row in enumerate(rows):
            for column, pixels in (
                ("image", seen.rgb),
                ("depth_mm", seen.depth_mm),
                ("instance", seen.instance),
                ("label", seen.classes[seen.instance]),
            ):
                np.testing.assert_array_equal(np.asarray(row[column]), pixels[number])
            np.testing.assert_array_equal(row["camera_to_map"], seen.camera_to_map[number])
            assert list(row["intrinsics"].values()) == seen.intrinsics[number].tolist()
    objects = splits["validation"][0]["objects"]
    assert objects == {"id": [1], "category": [CLASS_LIST.index("chair")], "area": [160], "bbox": [[8, 4, 10, 16]]}
    assert splits["train"].features["objects"]["category"].feature.names == list(CLASS_LIST[:-1])


def test_without_pyarrow_nothing_is_collected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)

    with pytest.raises(BenchbotError, match="pyarrow is not installed") as caught:
        collect(str(SEEDS[1]), tmp_path, formats="arrays,parquet")
    assert "benchbot-baselines[parquet]" in str(caught.value.fix)
    assert not list(tmp_path.iterdir())


def test_depth_and_poses_put_the_floor_at_zero(undisturbed: Path) -> None:
    seen = read_shots(place_file(undisturbed, SEEDS[1]))
    lowest_m = []
    for row, (fx, fy, cx, cy) in enumerate(seen.intrinsics):
        v, u = np.mgrid[0 : seen.depth_mm.shape[1], 0 : seen.depth_mm.shape[2]]
        depth_m = seen.depth_mm[row] / 1000
        points = np.stack([(u - cx) / fx * depth_m, (v - cy) / fy * depth_m, depth_m], -1)[depth_m > 0]
        z = (points @ seen.camera_to_map[row, :3, :3].T + seen.camera_to_map[row, :3, 3])[:, 2]
        lowest_m.append(z.min())
    # Something stands before all of the floor in one of the views.
    assert min(lowest_m) == pytest.approx(0, abs=0.005)


def test_what_was_killed_goes_on_and_ends_with_the_same_bytes(
    undisturbed: Path, kernel_cache: Path, tmp_path: Path
) -> None:
    folder = drawn(tmp_path / "data")
    first = place_file(folder, SEEDS[0])
    with collecting(folder, kernel_cache) as process:
        while not (folder / "parquet" / f"validation-{SEEDS[0]:06d}.parquet").exists() and process.poll() is None:
            time.sleep(0.005)
        process.kill()
    assert not place_file(folder, SEEDS[1]).exists()
    kept = first.stat().st_mtime_ns

    assert files(collected(folder, kernel_cache)) == files(undisturbed)
    assert first.stat().st_mtime_ns == kept, "it was made again"


def test_a_worker_that_is_killed_is_told_of(kernel_cache: Path, tmp_path: Path) -> None:
    with collecting(drawn(tmp_path / "data"), kernel_cache) as process:
        while process.poll() is None and not (workers := psutil.Process(process.pid).children(recursive=True)[1:]):
            time.sleep(0.005)
        workers[-1].kill()
        _, told = process.communicate()

    assert process.returncode == 2
    assert "was ended from outside" in told
    assert "fewer --workers" in told


@given(arrays.arrays(np.uint16, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 3)))
def test_pycocotools_reads_the_runs_and_finds_the_box(instance: np.ndarray) -> None:
    height, width = instance.shape
    for number in np.unique(instance):
        own = runs(instance).of(int(number))
        rle = coco_mask.frPyObjects({"size": [height, width], "counts": own.counts()}, height, width)

        assert (coco_mask.decode(rle) == (instance == number)).all()
        assert own.box() == coco_mask.toBbox(rle).tolist()


def test_a_folder_of_other_settings_is_refused(tmp_path: Path) -> None:
    begin(tmp_path, Settings(views=3))
    begin(tmp_path, Settings(views=3))

    with pytest.raises(BenchbotError, match="other settings"):
        begin(tmp_path, Settings(views=4))


def test_views_of_objects_come_first_and_those_before_a_wall_last() -> None:
    classes = np.array([len(CLASS_LIST) - 1, len(CLASS_LIST) - 1, 3], np.uint8)
    shown = [1, 2, 2, 2]
    instance = np.stack([np.full((4, 4), number) for number in shown])
    depth_m = np.stack([np.full((4, 4), far) for far in (3.0, 0.4, 3.0, np.inf)])

    assert telling(instance, depth_m, classes) == [2, 0, 1, 3]
