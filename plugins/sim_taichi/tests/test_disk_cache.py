"""A file of the cache gives back what was stored or counts as not there."""

import threading
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
