"""Make episodes of tidy_up: `python -m benchbot_task_manipulation.make_episodes tidyroom:1 --seed 0 --count 50`.

Where objects begin and which one goes where is drawn from the seed: the same seed gives the same bytes. An episode is
kept when the simulated robot can do it: objects come to rest where they were drawn, and object and place can be reached
from standing places that a free way leads to.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from benchbot.cli.kit import console
from benchbot.plugin import BenchbotError, Catalog, PlatformSpec, Pose, Scene, cache_dir, load_plugins, write_atomically
from benchbot_scenes.scene import Instance, SceneGeometry
from benchbot_sim_mujoco.simulator import MujocoSimulator

Box = tuple[np.ndarray, np.ndarray]

ROBOT = "carter_arm"
PLACES = ("tray", "coffee table", "stool")
OBJECTS = ("cup", "apple", "orange", "cake")
SUPPORT = "table"
FROM_EDGE_M = (0.07, 0.30)
"""How far objects stand from the edge of the table that the robot comes to."""
FROM_CORNER_M, APART_M = 0.15, 0.18
ROOM_M, STANDING_M, ABOVE_M = 0.45, 0.03, 0.1
"""Clearances of the robot's footprint: where it starts, and where it stands to reach something; and how high above an
object or place its fingers must come."""
NEARER_M = (0.55, 0.6, 0.65, 0.7)
TRIES_PER_EPISODE = 400
DOWN = (1.0, 0.0, 0.0, 0.0)
SUCCESS_M = 0.2


@dataclass(frozen=True)
class Room:
    """A scene to draw episodes in: its simulator, and the boxes (low, high) of its objects by name."""

    simulator: MujocoSimulator
    scene: Scene
    boxes: Mapping[str, Box]
    classes: Mapping[str, str]

    def of_class(self, name: str) -> str:
        """Return the object of a class that is nearest to the start."""
        start = np.array(self.scene.start_pose.translation_xyz[:2])
        named = [each for each, class_name in self.classes.items() if class_name == name]
        if not named:
            raise BenchbotError(
                f"There is no {name} in '{self.scene.environment['name']}'.",
                f"Episodes of tidy_up need: {', '.join((SUPPORT, *PLACES, *OBJECTS))}.",
                "Add one to the layout, or make episodes for another environment.",
            )
        return min(named, key=lambda each: float(np.linalg.norm(np.add(*self.boxes[each])[:2] / 2 - start)))


def main() -> int:
    """Write the lists of the named environments into this package's folder, or into --into."""
    parser = argparse.ArgumentParser(prog="python -m benchbot_task_manipulation.make_episodes", description=__doc__)
    parser.add_argument("environments", nargs="+", metavar="ENV")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--into", type=Path, default=Path(__file__).parent / "episodes")
    options = parser.parse_args()
    try:
        for name in options.environments:
            listed = episodes(name, options.seed, options.count)
            path = options.into / f"{name.replace(':', '_')}.json"
            write_atomically(path, as_text(listed).encode())
            console.data(f"{path}: {options.count} episodes")
    except BenchbotError as error:
        console.error(error)
        return int(error.exit_code)
    return 0


def episodes(environment: str, seed: int, count: int) -> dict[str, Any]:
    """Return a list of episodes; raises BenchbotError where the robot cannot do enough of what is drawn."""
    room = open_room(environment)
    drawn: list[dict[str, Any]] = []
    random = np.random.default_rng(seed)
    for _ in range(TRIES_PER_EPISODE * count):
        episode = _drawn(room, random, f"tidy_up/{environment.replace(':', '_')}/{len(drawn):03}")
        if episode is not None and is_possible(room, episode):
            drawn.append(episode)
        if len(drawn) == count:
            return {
                "version": 1,
                "task": "tidy_up",
                "environment": environment,
                "robot_radius_m": room.simulator.robot.footprint.radius_m,
                "success_distance_m": SUCCESS_M,
                "episodes": drawn,
            }
    raise BenchbotError(
        f"There is no room for {count} episodes of tidy_up in '{environment}'.",
        f"Of {TRIES_PER_EPISODE * count} that were drawn the robot can do {len(drawn)}.",
        "Ask for fewer, or leave more floor free around tables and places.",
    )


def open_room(environment: str) -> Room:
    """Return a room by the name of its environment, with the robot in it."""
    catalog = Catalog(load_plugins())
    declared = catalog.get("environments", environment)
    spec = PlatformSpec(cast(Any, catalog.get("robots", ROBOT).data), "ground_truth", cache_dir())
    simulator = MujocoSimulator(spec)
    scene = Scene(cast(Any, declared.data), declared.path.parent)
    simulator.load(scene, 0)
    geometry = simulator.world.geometry
    boxes = {instance.name: _box(geometry, instance) for instance in geometry.instances}
    classes = {instance.name: instance.class_name for instance in geometry.instances if instance.class_name}
    return Room(simulator, scene, boxes, classes)


def is_possible(room: Room, episode: Mapping[str, Any]) -> bool:
    """Return whether objects stay where the episode puts them, and the robot can reach object and place."""
    start = Pose.from_wxyz_xyz(episode["start_pose"])
    placed = {**room.scene.environment, "start_pose": episode["start_pose"], "objects": episode["objects"]}
    try:
        room.simulator.load(Scene(cast(Any, placed), room.scene.folder), 0)
    except BenchbotError:
        return False
    name = episode["goal"]["fetch"]["name"]
    at = next(each["position"] for each in episode["objects"] if each["name"] == name)
    low, high = room.boxes[name]
    middle = np.array(at) + np.array([0.0, 0.0, (high - low)[2] / 2])
    place = episode["goal"]["place"]
    top = np.array(place["centroid"]) + np.array([0.0, 0.0, place["extent"][2] / 2 + (high - low)[2] / 2])
    nearest = _towards(top, start, np.array(place["extent"]))
    return any(_standing(room, middle)) and any(_standing(room, nearest))


def as_text(listed: Mapping[str, Any]) -> str:
    """Return a list as JSON, one episode a line."""
    head = {key: value for key, value in listed.items() if key != "episodes"}
    rows = ",\n  ".join(json.dumps(episode, sort_keys=True) for episode in listed["episodes"])
    return f'{json.dumps(head, sort_keys=True, indent=1)[:-2]},\n "episodes": [\n  {rows}\n ]\n}}\n'


def _drawn(room: Room, random: np.random.Generator, name: str) -> dict[str, Any] | None:
    """Return what is drawn for one episode; None where objects would stand too near each other."""
    low, high = room.boxes[room.of_class(SUPPORT)]
    loose = list(room.simulator.world.physics.loose)
    depth = random.uniform(*FROM_EDGE_M, len(loose))
    along = random.uniform(low[1] + FROM_CORNER_M, high[1] - FROM_CORNER_M, len(loose))
    turns = random.uniform(-180.0, 180.0, len(loose))
    fetched = room.of_class(str(random.choice(OBJECTS)))
    place = str(random.choice(PLACES))
    start = _start(room, random)
    spots = np.column_stack([low[0] + depth, along])
    if start is None or _closest_m(spots) < APART_M:
        return None
    box = room.boxes[room.of_class(place)]
    stops = (spots[loose.index(fetched)], (box[0] + box[1])[:2] / 2)
    way_m = math.dist(start[:2], stops[0]) + math.dist(*stops)
    return {
        "id": name,
        "start_pose": [
            round(value, 6) for value in (math.cos(start[2] / 2), 0.0, 0.0, math.sin(start[2] / 2), *start[:2], 0.0)
        ],
        "objects": [
            {
                "name": each,
                "position": [round(float(x), 4), round(float(y), 4), round(float(high[2]), 4)],
                "turn_deg": round(float(turn), 1),
            }
            for each, (x, y), turn in zip(loose, spots, turns, strict=True)
        ],
        "goal": {
            "fetch": {"name": fetched, "class": room.classes[fetched]},
            "place": {"class": place, **_centred(box)},
        },
        "shortest_path_m": round(way_m, 6),
    }


def _start(room: Room, random: np.random.Generator) -> tuple[float, float, float] | None:
    corners = np.array(list(room.boxes.values()))
    low, high = corners[:, 0, :2].min(0), corners[:, 1, :2].max(0)
    x, y = random.uniform(low, high)
    yaw = float(random.uniform(-math.pi, math.pi))
    free_m = room.simulator.world.clearance_m(float(x), float(y))
    inside = not room.simulator.world.covers(float(x), float(y))
    return (float(x), float(y), yaw) if inside and ROOM_M < free_m < math.inf else None


def _standing(room: Room, target: np.ndarray) -> Iterator[bool]:
    """Yield for places to stand around a point whether they are free and the hand comes to the point and above it."""
    world, arm = room.simulator.world, room.simulator.arm()
    radius_m = room.simulator.robot.footprint.radius_m
    for away_m in NEARER_M:
        reachable = all(arm.reaches(Pose((away_m, 0.0, target[2] + up), DOWN)) for up in (0.0, ABOVE_M))
        for heading in np.linspace(0, 2 * math.pi, 24, endpoint=False):
            x, y = target[:2] - away_m * np.array([math.cos(heading), math.sin(heading)])
            free = world.clearance_m(float(x), float(y)) > radius_m + STANDING_M and not world.covers(
                float(x), float(y)
            )
            yield reachable and free


def _towards(top: np.ndarray, start: Pose, extent: np.ndarray) -> np.ndarray:
    """Return the point on a place that is towards the start, no nearer to its edges than a hand is wide."""
    free = np.maximum(extent[:2] / 2 - 0.12, 0.0)
    aside = np.clip(np.array(start.translation_xyz[:2]) - top[:2], -free, free)
    return np.array([*(top[:2] + aside), top[2]])


def _closest_m(spots: np.ndarray) -> float:
    apart = np.linalg.norm(spots[:, None] - spots[None], axis=-1)
    return float(apart[~np.eye(len(spots), dtype=bool)].min(initial=np.inf))


def _box(geometry: SceneGeometry, instance: Instance) -> Box:
    corners = geometry.vertices[geometry.triangles[geometry.triangle_instance == instance.index]].reshape(-1, 3)
    return corners.min(0).astype(float), corners.max(0).astype(float)


def _centred(box: Box) -> dict[str, list[float]]:
    low, high = box
    return {"centroid": _rounded((low + high) / 2), "extent": _rounded(high - low)}


def _rounded(values: Sequence[float] | np.ndarray) -> list[float]:
    return [round(float(value), 4) for value in values]


if __name__ == "__main__":
    sys.exit(main())
