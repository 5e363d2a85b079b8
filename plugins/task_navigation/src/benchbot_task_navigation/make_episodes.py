"""Make floor plans and episodes: `python -m benchbot_task_navigation.make_episodes miniroom:1 house:1`.

The same environment, robot and seed give the same bytes. The obstacles of a real environment are those of its map;
those of a ray-traced scene benchbot-sim-taichi knows.
"""

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from benchbot.cli.kit import console
from benchbot.plugin import (
    BenchbotError,
    Catalog,
    Declaration,
    GroundTruths,
    Scene,
    cache_dir,
    load_plugins,
    occupancy_map,
    read_declaration,
    write_atomically,
)
from benchbot_task_navigation.floor_plan import Floats, FloorPlan, Mask
from benchbot_task_navigation.generate import Place, Sees, mended_point_goals, object_goals, point_goals
from benchbot_task_navigation.ways import Ways

if TYPE_CHECKING:
    from benchbot_scenes.scene import SceneGeometry

RESOLUTION_M = 0.025
BORDER_NODES = 4
ANY_HEIGHT_DEG = 90.0


def geometry_of(scene: Scene) -> "SceneGeometry":
    """Return what stands in a ray-traced scene."""
    from benchbot_scenes.gltf import load_scene
    from benchbot_scenes.scene_file import scene_file

    source = scene.folder / scene.environment["map_path"]
    return load_scene(scene_file(source, cache_dir(), scene.environment.get("assets")))


def floor_plan(scene: Scene, geometry: "SceneGeometry", robot: Mapping[str, Any]) -> FloorPlan:
    """Return the plan of what a robot can reach in a ray-traced scene, cut off a little beyond that."""
    from benchbot_scenes.obstacle_map import ObstacleMap

    x, y, z = scene.start_pose.translation_xyz
    footprint = robot["footprint"]
    obstacles = ObstacleMap(geometry, z + footprint["z_min_m"], z + footprint["z_max_m"])
    corners = geometry.vertices[np.isfinite(geometry.vertices).all(1), :2]
    low = np.floor(corners.min(0) / RESOLUTION_M).astype(int)
    high = np.ceil(corners.max(0) / RESOLUTION_M).astype(int)
    clearance_m = np.array(
        [
            [obstacles.distance_m(i * RESOLUTION_M, j * RESOLUTION_M) for j in range(low[1], high[1] + 1)]
            for i in range(low[0], high[0] + 1)
        ]
    )
    return _reached(low, clearance_m, (x, y), footprint["radius_m"])


def mapped_plan(found: occupancy_map.OccupancyMap, start_xy: tuple[float, float], radius_m: float) -> FloorPlan:
    """Return the plan of what a disc can reach in a map: all that is not known to be free is in its way.

    Distances are those to the nearest such cell, from the middle of a cell less half a side, and so exact to a cell.
    """
    side_m = found.resolution_m
    # What is beyond the picture is not known either.
    inside_m = ndimage.distance_transform_edt(np.pad(found.free, 1))[1:-1, 1:-1] * side_m - side_m / 2
    corners = found.corners()
    low, high = np.floor(corners.min(0) / RESOLUTION_M).astype(int), np.ceil(corners.max(0) / RESOLUTION_M).astype(int)
    nodes = np.stack(np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1), indexing="ij"), 2)
    clearance_m = found.at(np.maximum(inside_m, 0.0), nodes.reshape(-1, 2) * RESOLUTION_M).reshape(nodes.shape[:2])
    return _reached(low, clearance_m, start_xy, radius_m)


def _reached(low: Any, clearance_m: Floats, start_xy: tuple[float, float], radius_m: float) -> FloorPlan:
    """Return the part of a plan about what a disc can reach from its start: inside of furniture there is room, too."""
    whole = FloorPlan(_place(low), RESOLUTION_M, clearance_m)
    inside = np.argwhere(Ways(whole, radius_m, reach=1).reachable(start_xy))
    first = np.maximum(inside.min(0) - BORDER_NODES, 0)
    last = inside.max(0) + BORDER_NODES + 1
    cut = FloorPlan(_place(low + first), RESOLUTION_M, clearance_m[first[0] : last[0], first[1] : last[1]])
    return FloorPlan.from_ground_truth(cut.as_ground_truth())


def sight(geometry: "SceneGeometry", robot: Mapping[str, Any], floor_m: float) -> Sees:
    """Return what says from where a robot has an object in its line of sight, at the height of its camera.

    Glass hides nothing. The picture's edges do not count: what a robot has driven up to may be below them.
    """
    from benchbot_scenes import visibility

    eye_m = floor_m + visibility.observer(robot).eye_m
    scene = visibility.voxels(geometry)
    targets = {target.name: target for target in visibility.targets(geometry)}

    def sees(item: Mapping[str, Any], places: Floats) -> Mask:
        eyes = np.column_stack([places, np.full(len(places), eye_m)])
        return visibility.seen_from(eyes, [targets[item["ID_name"]]], scene, np.inf, ANY_HEIGHT_DEG)[:, 0]

    return sees


def _place(node: Any) -> tuple[float, float]:
    x, y = (round(float(value), 6) for value in node * RESOLUTION_M)
    return x, y


def main() -> int:
    """Write the files; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m benchbot_task_navigation.make_episodes",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "environments",
        nargs="+",
        metavar="NAME:VARIANT",
        help="real environments with a map, or ones of type sim_taichi",
    )
    parser.add_argument("--robot", default="carter", help="whose radius and height count (carter)")
    parser.add_argument("--seed", type=int, default=0, help="what the episodes are drawn from (0)")
    parser.add_argument("--count", type=int, default=20, help="how many episodes of each task (20)")
    parser.add_argument(
        "--mend",
        type=Path,
        metavar="FOLDER",
        help="write the lists of point goals in this folder's episodes again, after a place has changed: starts and "
        "goals stay, but for those of episodes that would not be drawn any more",
    )
    parser.add_argument("--output", type=Path, default=Path(), metavar="FOLDER", help="where the files go (here)")
    asked = parser.parse_args()
    try:
        for environment in asked.environments:
            _make(environment, asked.robot, asked.seed, asked.count, asked.output, asked.mend)
    except BenchbotError as error:
        console.error(error)
        return error.exit_code
    return 0


def _make(environment: str, robot_name: str, seed: int, count: int, folder: Path, mend: Path | None) -> None:
    catalog = Catalog(load_plugins())
    (declared,) = catalog.environments(environment)[:1]
    robot = catalog.get("robots", robot_name).data
    scene = Scene(declared.data, declared.path.parent)
    start_xyz, radius_m = scene.start_pose.translation_xyz, robot["footprint"]["radius_m"]
    file_name = declared.name.replace(":", "_")
    if declared.data["type"] == occupancy_map.REAL:
        found = occupancy_map.read(occupancy_map.map_file(declared.data, declared.path.parent))
        plan = mapped_plan(found, start_xyz[:2], radius_m)
        geometry = None
    elif declared.data["type"] == robot["type"] == "sim_taichi":
        geometry = geometry_of(scene)
        plan = floor_plan(scene, geometry, robot)
    else:
        raise BenchbotError(
            f"'{environment}' cannot be planned for '{robot_name}'.",
            "Obstacles are known of real environments with a map, and of ray-traced scenes for ray-traced robots: "
            "those of type sim_taichi.",
            "Choose such ones, or make a plan with benchbot_task_navigation.floor_plan and generate.",
        )
    place = Place(declared.name, plan, start_xyz, radius_m)
    if mend is not None:
        listed = read_declaration(mend / "episodes" / "point_goal" / f"{file_name}.json")
        _write(folder / "episodes" / "point_goal" / f"{file_name}.json", mended_point_goals(place, listed, seed))
        return
    _write(folder / "ground_truths" / f"floor_plan_{file_name}.json", ground_truth(catalog, declared, plan))
    _write(folder / "episodes" / "point_goal" / f"{file_name}.json", point_goals(place, seed, count))
    if geometry is None:
        console.note("No episodes of object_goal: a map does not say from where an object is seen.")
        return
    try:
        objects = GroundTruths.of(catalog, None).find(declared.name, {"object_map_ground_truth"})
    except BenchbotError as error:
        console.note(f"No episodes of object_goal: {error.title}")
        return
    sees = sight(geometry, robot, start_xyz[2])
    listed = object_goals(place, objects["ground_truth"]["objects"], sees, seed, count)
    _write(folder / "episodes" / "object_goal" / f"{file_name}.json", listed)


def ground_truth(catalog: Catalog, environment: Declaration, plan: FloorPlan) -> dict[str, Any]:
    """Return the plan of an environment as the document that `--ground-truth` and evaluators read."""
    return {
        "environment": {key: environment.data[key] for key in ("name", "variant")},
        "format": catalog.get("formats", "floor_plan").data,
        "ground_truth": plan.as_ground_truth(),
    }


def _write(path: Path, document: Mapping[str, Any]) -> None:
    """Write a document, a line for each of its keys and for each episode, and print its path."""
    write_atomically(path, _lines(document).encode())
    console.data(str(path))


def _lines(document: Mapping[str, Any]) -> str:
    short = {key: value for key, value in document.items() if key != "episodes"}
    lines = [f" {json.dumps(key)}: {json.dumps(value, sort_keys=True)}" for key, value in sorted(short.items())]
    if "episodes" in document:
        episodes = ",\n".join(f"  {json.dumps(episode, sort_keys=True)}" for episode in document["episodes"])
        lines.append(f' "episodes": [\n{episodes}\n ]')
    return "{\n" + ",\n".join(lines) + "\n}\n"


if __name__ == "__main__":
    sys.exit(main())
