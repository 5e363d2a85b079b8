"""Objects that are moved, added and taken away: afterwards all is as in a renderer made of the changed scene."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot.core.geometry import Pose
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import bvh, two_levels
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.renderer import Intrinsics, Renderer
from benchmarks.rays.scene import generate
from plugins.sim_taichi.tests.cameras import looking
from plugins.sim_taichi.tests.embree import Embree
from plugins.sim_taichi.tests.rooms import furnished_room
from plugins.sim_taichi.tests.test_bvh import leaves

pytestmark = pytest.mark.xdist_group("renderer")

CAMERA = Intrinsics.from_horizontal_fov(160, 90, 90.0)
SMALL = Intrinsics.from_horizontal_fov(48, 27, 90.0)
VIEWS = [looking((3.0, 2.5, 1.4), yaw, -15.0) for yaw in range(0, 360, 60)]
DAY = Lighting(exposure=1.0)


def at(x: float, y: float, z: float, yaw_rad: float = 0.0) -> np.ndarray:
    return Pose.planar(x, y, yaw_rad, z).matrix()


def shifted(scene: SceneGeometry, instance: int, transform: np.ndarray) -> SceneGeometry:
    """The same change, made to the scene itself."""
    used = np.unique(scene.triangles[scene.triangle_instance == instance])
    vertices, normals = scene.vertices.copy(), scene.normals.copy()
    vertices[used] = vertices[used].astype(np.float64) @ transform[:3, :3].T + transform[:3, 3]
    normals[used] = normals[used].astype(np.float64) @ transform[:3, :3].T
    return replace(scene, vertices=vertices, normals=normals)


def only(scene: SceneGeometry, kept: np.ndarray) -> SceneGeometry:
    return replace(
        scene,
        triangles=scene.triangles[kept],
        triangle_instance=scene.triangle_instance[kept],
        triangle_material=scene.triangle_material[kept],
    )


def assert_sees(renderer: Renderer, scene: SceneGeometry, cache: Path) -> None:
    """Depth and instances are those of a renderer made of `scene`, and Embree's."""
    fresh, embree = Renderer(scene, DAY, cache_dir=cache), Embree(scene)
    embree_equal = []
    for view in VIEWS:
        ours, theirs = renderer.render(view, CAMERA, rgb=False), fresh.render(view, CAMERA, rgb=False)
        assert np.mean(ours.instance == theirs.instance) >= 0.9999
        np.testing.assert_allclose(ours.depth_m, theirs.depth_m, atol=1e-3)
        embree_equal.append(embree.see(view, CAMERA)[1] == ours.instance)
    assert np.mean(embree_equal) >= 0.999
    directions = np.random.default_rng(1).normal(size=(1000, 3))
    origins = np.tile([3.0, 2.5, 1.4], (1000, 1))
    np.testing.assert_allclose(
        renderer.cast(origins, directions, 30.0), fresh.cast(origins, directions, 30.0), atol=1e-4
    )


def curved_things(scene: SceneGeometry) -> list[int]:
    """The instances of most triangles."""
    return [int(index) for index in np.bincount(scene.triangle_instance).argsort(kind="stable")[::-1][:12]]


def test_moved_objects_are_where_they_were_put(kernel_cache: Path) -> None:
    scene = generate(20_000, seed=3)
    renderer = Renderer(scene, DAY, cache_dir=kernel_cache)
    expected = scene
    for number, thing in enumerate(curved_things(scene)):  # more than one node has children
        renderer.move(thing, at(9.0, 9.0, 9.0))
        transform = at(0.1 * number - 0.5, 0.2, 0.03 * number, 0.1 * number)
        renderer.move(thing, transform)
        expected = shifted(expected, thing, transform)
    assert np.array_equal(renderer.scene.vertices, expected.vertices)
    assert_sees(renderer, expected, kernel_cache)


def test_an_object_put_back_leaves_no_trace(kernel_cache: Path) -> None:
    scene = generate(20_000, seed=3)
    renderer = Renderer(scene, DAY, cache_dir=kernel_cache)
    before = [renderer.render(view, CAMERA, rgb=False) for view in VIEWS]
    thing = curved_things(scene)[0]
    renderer.move(thing, at(1.0, 0.0, 0.5, 2.0))
    renderer.move(thing, np.eye(4))
    for view, old in zip(VIEWS, before, strict=True):
        new = renderer.render(view, CAMERA, rgb=False)
        assert np.array_equal(new.depth_m, old.depth_m)
        assert np.array_equal(new.instance, old.instance)


def test_removed_objects_are_gone(kernel_cache: Path) -> None:
    scene = generate(20_000, seed=3)
    renderer = Renderer(scene, DAY, cache_dir=kernel_cache)
    stood, moved = curved_things(scene)[:2]
    renderer.move(moved, at(0.3, 0.0, 0.0))
    for gone in (stood, moved):
        renderer.remove(gone)
    assert_sees(renderer, only(scene, ~np.isin(scene.triangle_instance, [stood, moved])), kernel_cache)
    with pytest.raises(BenchbotError, match=f"no object {stood}"):
        renderer.move(stood, np.eye(4))


def test_a_scene_may_lose_everything(kernel_cache: Path) -> None:
    scene = generate(2_000, seed=3)
    renderer = Renderer(scene, DAY, cache_dir=kernel_cache)
    for instance in scene.instances:
        renderer.remove(instance.index)
    assert not renderer.render(VIEWS[0], CAMERA).instance.any()


def test_added_objects_can_be_seen_and_moved(kernel_cache: Path, tmp_path: Path) -> None:
    room, other = generate(20_000, seed=3), load_scene(furnished_room(tmp_path / "room.glb"))
    names = [instance.name for instance in other.instances]
    ball, pane = names.index("ball") + 1, names.index("pane") + 1
    things = only(other, np.isin(other.triangle_instance, [ball, pane]))
    things = replace(things, instances=tuple(i for i in other.instances if i.index in (ball, pane)))
    renderer = Renderer(room, DAY, cache_dir=kernel_cache)
    before = renderer.render(VIEWS[0], CAMERA)
    numbers = renderer.add(things, at(1.2, 0.7, 0.4))
    assert set(numbers) == {len(room.instances) + ball, len(room.instances) + pane}
    red = numbers[[i.index for i in things.instances].index(ball)]
    frame = renderer.render(VIEWS[0], CAMERA)
    assert (frame.instance == red).any()
    assert (before.instance != red).all()
    lit = frame.rgb[frame.instance == red].mean(axis=0)
    assert lit[0] > 1.5 * lit[1] > 0
    renderer.move(red, at(-50.0, 0.0, 0.0))
    assert (renderer.render(VIEWS[0], CAMERA, rgb=False).instance != red).all()
    for number in numbers:
        renderer.remove(number)
    assert_sees(renderer, room, kernel_cache)


def test_a_moved_lamp_lights_all_anew(kernel_cache: Path, tmp_path: Path) -> None:
    scene = load_scene(furnished_room(tmp_path / "room.glb"))
    lamp = next(i.index for i in scene.instances if i.name == "bulb")
    night = Lighting.from_mapping({"time": "23:30", "date": "2023-06-21", "latitude_deg": 30, "exposure": 1.0})
    renderer, transform = Renderer(scene, night, cache_dir=kernel_cache), at(2.0, 0.0, 0.0)
    view = looking((0.8, 1.5, 1.2), 0.0)
    before = renderer.render(view, SMALL)
    renderer.move(lamp, transform)
    moved = renderer.render(view, SMALL)
    fresh = Renderer(shifted(scene, lamp, transform), night, cache_dir=kernel_cache).render(view, SMALL)
    assert np.abs(moved.rgb.astype(float) - fresh.rgb).mean() < 0.1
    assert np.abs(before.rgb.astype(float) - fresh.rgb).mean() > 5.0
    renderer.move(lamp, np.eye(4))
    back = renderer.render(view, SMALL)
    assert np.abs(back.rgb.astype(float) - before.rgb).mean() < 0.1


def test_light_stays_on_a_moved_object_until_all_is_lit_anew(kernel_cache: Path, tmp_path: Path) -> None:
    scene = load_scene(furnished_room(tmp_path / "room.glb"))
    ball = next(i.index for i in scene.instances if i.name == "ball")
    day = Lighting.from_mapping({"exposure": 1.0})
    view, transform = looking((0.8, 1.5, 1.2), 0.0), at(0.3, 0.3, 0.0)
    renderer = Renderer(scene, day, cache_dir=kernel_cache)
    before = renderer.render(view, SMALL)
    renderer.move(ball, transform)
    moved = renderer.render(view, SMALL)
    renderer.relight()
    relit = renderer.render(view, SMALL)
    fresh = Renderer(shifted(scene, ball, transform), day, cache_dir=kernel_cache).render(view, SMALL)
    np.testing.assert_array_equal(moved.depth_m, fresh.depth_m)
    unlike = {
        name: np.abs(frame.rgb.astype(float) - fresh.rgb).mean()
        for name, frame in (("before", before), ("moved", moved), ("relit", relit))
    }
    assert unlike["relit"] < 0.1
    assert unlike["relit"] < unlike["moved"] < unlike["before"]


def test_objects_that_share_vertices_part(kernel_cache: Path) -> None:
    scene = generate(2_000, seed=3)
    owner = np.where(np.arange(len(scene.triangles)) < 1001, 1, 2).astype(np.int32)
    scene = replace(scene, triangle_instance=owner, instances=scene.instances[:2])
    renderer = Renderer(scene, DAY, cache_dir=kernel_cache)
    renderer.move(1, at(0.0, 0.0, 0.1))
    still = scene.triangles[owner == 2]
    assert np.array_equal(renderer.scene.vertices[renderer.scene.triangles[owner == 2]], scene.vertices[still])
    assert_sees(renderer, renderer.scene, kernel_cache)


BAD = {
    "scaled": np.diag([2.0, 2, 2, 1]),
    "mirrored": np.diag([-1.0, 1, 1, 1]),
    "nan": np.full((4, 4), np.nan),
    "far": at(1e9, 0, 0),
    "flat": np.eye(3),
    "projective": np.eye(4) + np.eye(4)[3] * 0.1,
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_pose_is_refused(name: str, kernel_cache: Path) -> None:
    renderer = Renderer(generate(2_000, seed=3), DAY, cache_dir=kernel_cache)
    with pytest.raises(BenchbotError, match="no pose"):
        renderer.move(1, BAD[name])
    with pytest.raises(BenchbotError, match="no object 9999"):
        renderer.remove(9999)


WIDTHS = [bvh.WIDTH, bvh.NARROW]


def scattered(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles, none of which shares a vertex with another."""
    vertices = np.random.default_rng(5).uniform(-1, 1, (3 * count, 3)).astype(np.float32)
    return vertices, np.arange(3 * count, dtype=np.int32).reshape(-1, 3)


@pytest.mark.parametrize("width", WIDTHS)
def test_a_refitted_tree_holds_the_same_triangles_in_tight_boxes(width: int) -> None:
    vertices, triangles = scattered(1000)
    ids = np.arange(1000)
    tree = bvh.build(vertices, triangles, (ids[:600], ids[600:]), width)
    same = two_levels.refitted(tree, vertices, triangles)
    assert same.nodes.tobytes() == tree.nodes.tobytes()
    assert same.leaves.tobytes() == tree.leaves.tobytes()
    moved = two_levels.refitted(tree, -vertices[::-1], triangles)
    assert sorted(leaves(moved, moved.roots[0], width) + leaves(moved, moved.roots[1], width)) == ids.tolist()


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("parts", [0, 1, 3, 7, 30])
def test_trees_below_one_node_hold_all_that_they_hold_alone(width: int, parts: int) -> None:
    vertices, triangles = scattered(40 * (parts + 1))
    still, *things = np.split(np.arange(len(triangles)), parts + 1)
    levels = two_levels.Levels(bvh.build(vertices, triangles, (still[:30], still[30:]), width))
    for number, ids in enumerate(things):
        levels = levels.with_part(number, bvh.build(vertices, triangles, (ids[:25], ids[25:]), width))
    tree = levels.combined()
    assert tree.width == width
    solid, sheer = (leaves(tree, root, width) for root in tree.roots)
    assert sorted(solid) == [*still[:30], *(number for ids in things for number in ids[:25])]
    assert sorted(sheer) == [*still[30:], *(number for ids in things for number in ids[25:])]
    without_first = levels.without_part(0).combined()
    gone = set(things[0].tolist()) if things else set()
    held = (number for root in without_first.roots for number in leaves(without_first, root, width))
    assert sorted(held) == [number for number in range(len(triangles)) if number not in gone]
