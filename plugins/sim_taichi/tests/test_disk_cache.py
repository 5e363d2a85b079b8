"""A file of the cache gives back what was stored or counts as not there."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchbot_sim_taichi import bvh, device_scene, disk_cache
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.rays.scene import generate
from plugins.sim_taichi.tests.cameras import looking

ARRAYS = {"nodes": np.arange(40, dtype=np.float32), "roots": np.array([0, 3])}


def is_whole(stored: disk_cache.Arrays) -> bool:
    return stored.keys() == ARRAYS.keys() and all(np.array_equal(stored[name], ARRAYS[name]) for name in ARRAYS)


@pytest.mark.parametrize("flip", [1, 16, 128, 255])
def test_any_damaged_byte_is_noticed(tmp_path: Path, flip: int) -> None:
    path = tmp_path / "tree.npz"
    disk_cache.store(path, ARRAYS)
    whole = path.read_bytes()
    for place in range(len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= flip
        path.write_bytes(damaged)
        stored = disk_cache.load(path)
        # Bytes that say when and by what a file was made do not matter; a damaged name misses at the caller.
        assert stored is None or is_whole(stored) or stored.keys() != ARRAYS.keys()


def test_a_file_cut_short_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "tree.npz"
    disk_cache.store(path, ARRAYS)
    whole = path.read_bytes()
    for length in range(len(whole) - 1):
        path.write_bytes(whole[:length])
        assert disk_cache.load(path) is None


def test_many_may_write_the_same_file_at_once(tmp_path: Path) -> None:
    path = tmp_path / "tree.npz"
    large = {"nodes": np.arange(100_000, dtype=np.float32)}
    disk_cache.store(path, large)
    writers = [threading.Thread(target=disk_cache.store, args=(path, large)) for _ in range(8)]
    for writer in writers:
        writer.start()
    seen = [disk_cache.load(path) for _ in range(20)]
    for writer in writers:
        writer.join()
    assert all(stored is not None and np.array_equal(stored["nodes"], large["nodes"]) for stored in seen)
    assert [file.name for file in tmp_path.iterdir()] == ["tree.npz"]


def test_arrays_are_where_the_file_is_mapped_and_what_is_written_to_them_is_nobody_elses(tmp_path: Path) -> None:
    path = tmp_path / "tree.npz"
    arrays: disk_cache.Arrays = {
        "nodes": np.arange(2**19, dtype=np.float32),
        "flags": np.eye(3, dtype=np.uint8),
        "one": np.array(2.0),
    }
    disk_cache.store(path, arrays)
    before = path.read_bytes()

    one, other = disk_cache.load(path), disk_cache.load(path)

    assert one is not None
    assert other is not None
    assert str(path) in Path("/proc/self/maps").read_text("utf-8")
    assert all(array.ctypes.data % disk_cache.ALIGNMENT == 0 for array in one.values())
    assert all(np.array_equal(one[name], array) for name, array in arrays.items())
    one["nodes"][:] = -1.0
    assert np.array_equal(other["nodes"], arrays["nodes"])
    assert path.read_bytes() == before


def test_a_small_file_stays_what_it_was_for_who_has_read_it(tmp_path: Path) -> None:
    path = tmp_path / "tree.npz"
    disk_cache.store(path, ARRAYS)
    stored = disk_cache.load(path)
    path.write_bytes(b"cut short")
    assert stored is not None
    assert is_whole(stored)


def test_archives_of_other_programs_are_read(tmp_path: Path) -> None:
    path = tmp_path / "tree.npz"
    np.savez(path, allow_pickle=False, **ARRAYS)
    stored = disk_cache.load(path)
    assert stored is not None
    assert is_whole(stored)
    with np.load(path) as again:
        assert sorted(again.files) == sorted(ARRAYS)
    np.savez_compressed(path, allow_pickle=False, **ARRAYS)
    assert disk_cache.load(path) is None, "what is compressed cannot be mapped"


MAKE = """
import os, sys, time
from pathlib import Path
import numpy as np
from benchbot_sim_taichi import disk_cache

folder = Path(sys.argv[1])

def make():
    with (folder / "made").open("a") as made:
        made.write("x")
    while not (folder / "go").exists():
        time.sleep(0.01)
    return {"nodes": np.arange(9)}

print(disk_cache.load_or_make(folder / "tree.npz", {"nodes"}, make)["nodes"].sum(), flush=True)
"""


def making(folder: Path) -> "subprocess.Popen[str]":
    command = [sys.executable, "-c", MAKE, str(folder)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(condition: Callable[[], bool]) -> None:
    while not condition():
        time.sleep(0.02)


def test_one_process_makes_what_others_wait_for_and_one_that_is_killed_leaves_it_to_the_next(tmp_path: Path) -> None:
    made = tmp_path / "made"
    with making(tmp_path) as first:
        wait_for(made.exists)
        with making(tmp_path) as second, making(tmp_path) as third:
            for waiting in (second, third):
                assert waiting.stderr is not None
                assert waiting.stderr.readline() == "tree.npz is being made by another process: waiting for it.\n"
            first.kill()
            wait_for(lambda: made.read_text() == "xx")
            (tmp_path / "go").touch()
            said = [each.communicate()[0] for each in (second, third)]

    assert said == ["36\n", "36\n"]
    assert made.read_text() == "xx", "the first one, which was killed, and one of the others"
    assert not (tmp_path / "tree.lock").exists()


def test_a_folder_that_cannot_be_written_costs_time_only(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    made = disk_cache.load_or_make(tmp_path / "file" / "tree.npz", set(ARRAYS), lambda: ARRAYS)
    assert is_whole(made)


@pytest.mark.xdist_group("renderer")
def test_a_damaged_tree_is_built_again_and_one_of_another_version_is_left_alone(
    kernel_cache: Path, tmp_path: Path
) -> None:
    scene, view = generate(2_000, seed=3), looking((3.0, 2.5, 1.4), 30.0)
    camera = Intrinsics.from_horizontal_fov(32, 18, 90.0)
    expected = Renderer(scene, Lighting(), cache_dir=kernel_cache).render(view, camera, rgb=False).depth_m
    tree = tmp_path / f"tree-{device_scene.TREE_VERSION}-{bvh.WIDTH}-{scene.content_hash[:32]}.npz"
    older = tmp_path / f"tree-{device_scene.TREE_VERSION - 1}-{bvh.WIDTH}-{scene.content_hash[:32]}.npz"
    for path in (tree, older):
        path.write_bytes(b"rubbish")
    frame = Renderer(scene, Lighting(), cache_dir=tmp_path).render(view, camera, rgb=False)
    assert np.array_equal(frame.depth_m, expected)
    assert disk_cache.load(tree) is not None
    assert older.read_bytes() == b"rubbish"
