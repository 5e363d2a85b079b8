"""The tree holds every usable triangle once, whatever it is fed."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchbot_scenes.scene import Material, SceneGeometry
from benchbot_sim_taichi import bvh
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from plugins.sim_taichi.tests.cameras import looking

pytestmark = pytest.mark.xdist_group("renderer")


def leaves(tree: bvh.Bvh, root: int, width: int = bvh.WIDTH) -> list[int]:
    """Triangle ids below `root`, checking on the way that each child lies in its parent's box."""
    nodes = tree.nodes.reshape(-1, 8 * width)
    blocks = tree.leaves.reshape(-1, bvh.LEAF_STRIDE)
    found = []
    pending = [(root, np.full(3, -np.inf), np.full(3, np.inf))]
    while pending:
        node, low, high = pending.pop()
        for slot, child in enumerate(nodes[node, 6 * width : 7 * width].view(np.int32)):
            if child == bvh.EMPTY_CHILD:
                continue
            box_low = nodes[node, slot : 3 * width : width]
            box_high = nodes[node, 3 * width + slot : 6 * width : width]
            assert (box_low >= low).all()
            assert (box_high <= high).all()
            if child >= 0:
                pending.append((int(child), box_low, box_high))
            else:
                ids = blocks[~child, 36:].view(np.int32)
                found += [int(index) for index in ids if index >= 0]
    return found


@settings(max_examples=30, deadline=None)
@given(
    count=st.integers(0, 300),
    seed=st.integers(0, 2**31),
    spread=st.sampled_from([0.0, 1e-6, 1.0, 1e3]),
    width=st.sampled_from([4, 8]),
)
def test_every_triangle_is_in_the_tree_once(count: int, seed: int, spread: float, width: int) -> None:
    rng = np.random.default_rng(seed)
    centers = rng.uniform(-1, 1, (count, 1, 3)) * spread
    vertices = (centers + rng.uniform(-0.1, 0.1, (count, 3, 3))).reshape(-1, 3).astype(np.float32)
    triangles = np.arange(3 * count, dtype=np.int32).reshape(-1, 3)
    odd, even = np.arange(1, count, 2), np.arange(0, count, 2)
    tree = bvh.build(vertices, triangles, (even, odd), width)
    assert sorted(leaves(tree, tree.roots[0], width)) == even.tolist()
    assert sorted(leaves(tree, tree.roots[1], width)) == odd.tolist()


def test_identical_triangles_do_not_stop_the_build() -> None:
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    tree = bvh.build(np.tile(corner, (1000, 1)), np.arange(3000, dtype=np.int32).reshape(-1, 3), (np.arange(1000),))
    assert sorted(leaves(tree, 0)) == list(range(1000))


def test_leaves_are_filled() -> None:
    """A leaf is tested as a whole, so that half-empty ones cost as much as full ones."""
    rng = np.random.default_rng(5)
    vertices = (rng.uniform(-1, 1, (4000, 1, 3)) + rng.uniform(-0.02, 0.02, (4000, 3, 3))).reshape(-1, 3)
    triangles = np.arange(12000, dtype=np.int32).reshape(-1, 3)
    tree = bvh.build(vertices.astype(np.float32), triangles, (np.arange(4000),))
    assert len(tree.leaves) // bvh.LEAF_STRIDE < 4000 / 3.5


def test_triangles_that_are_none_are_left_out() -> None:
    vertices = np.array(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 0, 0], [np.inf, 0, 0], [2, 0, 0], [1e20, 0, 0]], np.float32
    )
    triangles = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 1, 5], [0, 2, 6], [1, 1, 2]], np.int32)
    assert leaves(bvh.build(vertices, triangles, (np.arange(6),)), 0) == [0]


@pytest.mark.parametrize("kind", ["empty", "nan", "degenerate", "mixed"])
def test_a_scene_of_rubbish_is_rendered_without_a_crash(kind: str, kernel_cache: Path) -> None:
    corner = np.array([[2, -1, 0], [2, 1, 0], [2, 0, 2]], np.float32)
    bad = {"nan": np.full((3, 3), np.nan, np.float32), "degenerate": np.repeat(corner[:1], 3, axis=0)}
    soups = {"empty": [], "nan": [bad["nan"]], "degenerate": [bad["degenerate"]], "mixed": [*bad.values(), corner]}
    vertices = np.concatenate([np.zeros((0, 3), np.float32), *soups[kind]]).astype(np.float32)
    triangles = np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
    scene = SceneGeometry(
        vertices=vertices,
        triangles=triangles,
        triangle_instance=np.ones(len(triangles), np.int32),
        triangle_material=np.zeros(len(triangles), np.int32),
        normals=np.zeros_like(vertices),
        uvs=np.zeros((len(vertices), 2), np.float32),
        materials=(Material(),),
        instances=(),
    )
    renderer = Renderer(scene, Lighting(), cache_dir=kernel_cache)
    frame = renderer.render(looking((0.0, 0.0, 1.0), 0.0), Intrinsics.from_horizontal_fov(32, 18, 60.0))
    assert np.isfinite(frame.depth_m).any() == (kind == "mixed")
