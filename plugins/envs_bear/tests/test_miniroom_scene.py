"""The committed scene: every object where it was published, nothing floating, nothing in another's way."""

from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from plugins.envs_bear.tests.conftest import Node

ROBOT_CLEARANCE_M = 0.33
SHELL = {"floor", "ceiling", "wall_south", "wall_north", "wall_east", "wall_west", "skirting"}


def _surface(parts: Iterable[Node]) -> trimesh.Trimesh:
    meshes = [trimesh.Trimesh(node.vertices, node.triangles, process=False) for node in parts]
    surface = trimesh.util.concatenate(meshes)
    assert isinstance(surface, trimesh.Trimesh)
    return surface


def _without(nodes: dict[str, Node], *names: str) -> trimesh.Trimesh:
    return _surface(node for name, node in nodes.items() if name not in names)


def test_every_published_object_has_its_published_box(nodes: dict[str, Node], published: dict[str, Any]) -> None:
    for entry in published["objects"]:
        node = nodes[entry["id"]]
        np.testing.assert_allclose((node.low + node.high) / 2, entry["centroid"], atol=0.005, err_msg=entry["id"])
        np.testing.assert_allclose(node.high - node.low, entry["extent"], atol=0.005, err_msg=entry["id"])
        assert node.tag == {"class": entry["class"], "instance": entry["id"], "group": entry["isgroup"]}


def test_only_published_objects_carry_a_class(nodes: dict[str, Node], published: dict[str, Any]) -> None:
    assert {name for name, node in nodes.items() if node.tag.get("class")} == {
        entry["id"] for entry in published["objects"]
    }


def test_ground_truth_is_the_box_of_the_scenes_own_vertices(nodes: dict[str, Node], truth: dict[str, Any]) -> None:
    for entry in truth["ground_truth"]["objects"]:
        node = nodes[entry["ID_name"]]
        # Its figures are the published ones; the models are placed to a tenth of a millimetre.
        np.testing.assert_allclose((node.low + node.high) / 2, entry["centroid"], atol=6e-5)
        np.testing.assert_allclose(node.high - node.low, entry["extent"], atol=6e-5)


def test_any_viewer_loads_it_upright(scene_path: Path) -> None:
    scene = trimesh.load_scene(scene_path)
    low, high = scene.bounds
    assert high[1] - low[1] == pytest.approx(2.60 + 2 * 0.20, abs=0.01)
    assert low[1] == pytest.approx(-0.20, abs=0.01)


def test_it_stays_within_its_budget(nodes: dict[str, Node], scene_path: Path) -> None:
    assert sum(len(node.triangles) for node in nodes.values()) <= 200_000
    assert scene_path.stat().st_size <= 6_000_000


def test_nothing_floats(nodes: dict[str, Node]) -> None:
    """Under the lowest points of each object, or under the sink's rim, another surface is within a centimetre."""
    standing = [node for name, node in nodes.items() if name not in SHELL and not node.tag.get("mounted")]
    floating = []
    for node in standing:
        lowest = node.vertices[node.vertices[:, 2] < node.low[2] + 0.002]
        points = node.vertices if node.tag.get("class") == "sink" else np.vstack([lowest, lowest.mean(axis=0)])
        starts = points + np.array([0, 0, 0.012])
        # Without the object itself: past its own bottom, a ray misses what touches that.
        others = _without(nodes, node.name).ray
        hits, rays, _ = others.intersects_location(starts, np.tile([0.0, 0, -1], (len(starts), 1)), multiple_hits=False)
        gaps = np.abs(points[rays, 2] - hits[:, 2])
        if not np.any(gaps <= 0.010):
            floating.append((node.name, float(gaps.min())))
    assert floating == []


def test_objects_do_not_cut_into_each_other(nodes: dict[str, Node]) -> None:
    """No edge of a published object crosses another's surface, once lifted 6 mm off what carries it.

    What stands on the object itself, and leaves of neighbouring plants, may touch it.
    """
    crossing = []
    for name, node in nodes.items():
        category = node.tag.get("class")
        if category is None:
            continue
        others = [other for other in nodes.values() if other.name != name and not _foliage(other, category)]
        owner = np.repeat(np.arange(len(others)), [len(other.triangles) for other in others])
        edges = np.unique(np.sort(node.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        starts, ends = (node.vertices[edges[:, side]] + [0, 0, 0.006] for side in (0, 1))
        spans = np.linalg.norm(ends - starts, axis=1)
        solid = spans > 1e-6
        starts, ends, spans = starts[solid], ends[solid], spans[solid]
        hits, rays, triangles = _surface(others).ray.intersects_location(
            starts, (ends - starts) / spans[:, None], multiple_hits=False
        )
        standing_on_it = hits[:, 2] - np.array([other.low[2] for other in others])[owner[triangles]] < 0.012
        cut = (np.linalg.norm(hits - starts[rays], axis=1) < spans[rays]) & ~standing_on_it
        culprits = {others[index].name for index in owner[triangles[cut]]}
        if cut.any():
            crossing.append((name, int(cut.sum()), culprits, hits[cut].mean(axis=0).round(3).tolist()))
    assert crossing == []


def _foliage(node: Node, category: str) -> bool:
    return category == "potted plant" == node.tag.get("class")


def test_the_robot_has_room_all_along_its_trajectory(nodes: dict[str, Node], environment: dict[str, Any]) -> None:
    way = np.array([pose[4:6] for pose in [environment["start_pose"], *environment["trajectory_poses"]]])
    surface = _surface(nodes.values())
    in_the_way = surface.triangles[
        (surface.triangles[:, :, 2].max(axis=1) > 0.02) & (surface.triangles[:, :, 2].min(axis=1) < 1.2)
    ]
    corners = in_the_way[:, [0, 1, 2, 0], :2]
    points = np.vstack([corners[:, :3].reshape(-1, 2), _along(corners)])
    near = np.all((points > way.min(axis=0) - 1) & (points < way.max(axis=0) + 1), axis=1)
    points = np.unique(points[near].round(4), axis=0)
    nearest = min(_distance(points, first, last).min() for first, last in pairwise(way))
    assert nearest >= ROBOT_CLEARANCE_M


def _along(corners: NDArray[np.float64], step_m: float = 0.02) -> NDArray[np.float64]:
    """Points every `step_m` along the edges (M, 4, 2) of triangles."""
    first, last = corners[:, :3].reshape(-1, 2), corners[:, 1:].reshape(-1, 2)
    count = np.ceil(np.linalg.norm(last - first, axis=1) / step_m).astype(int)
    which = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)) / count[which]
    points: NDArray[np.float64] = first[which] + (last - first)[which] * share[:, None]
    return points


def _distance(
    points: NDArray[np.float64], first: NDArray[np.float64], last: NDArray[np.float64]
) -> NDArray[np.float64]:
    way = last - first
    share = np.clip((points - first) @ way / max(float(way @ way), 1e-12), 0, 1)
    distances: NDArray[np.float64] = np.linalg.norm(points - first - share[:, None] * way, axis=1)
    return distances


def test_the_robot_stands_inside_the_room(nodes: dict[str, Node], environment: dict[str, Any]) -> None:
    poses = np.array([environment["start_pose"], *environment["trajectory_poses"]])
    np.testing.assert_allclose(np.linalg.norm(poses[:, :4], axis=1), 1.0, atol=1e-5)
    assert np.all(poses[:, 6] == 0.0)
    floor = nodes["floor"]
    assert np.all(poses[:, 4:6] > floor.low[:2] + ROBOT_CLEARANCE_M)
    assert np.all(poses[:, 4:6] < floor.high[:2] - ROBOT_CLEARANCE_M)
    assert floor.high[2] == pytest.approx(0.0, abs=1e-6)


def test_light_enters_through_the_window_only(nodes: dict[str, Node]) -> None:
    """Rays from the middle of the room to all sides leave it through the window's panes or not at all."""
    panes = [name for name in nodes if name == "window"]
    shell = _without(nodes, *panes)
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(20_000, 3))
    starts = np.tile([1.0, 1.4, 1.5], (len(directions), 1))
    escaped = ~shell.ray.intersects_any(starts, directions)  # type: ignore[no-untyped-call]
    window = nodes["window"]
    way = directions[escaped]
    assert len(way) > 100
    assert np.all(way[:, 1] < 0)
    plane = np.array([1.0, 1.4, 1.5]) + way * ((window.high[1] - 1.4) / way[:, 1])[:, None]
    assert np.all(plane[:, [0, 2]] > window.low[[0, 2]] - 0.01)
    assert np.all(plane[:, [0, 2]] < window.high[[0, 2]] + 0.01)
