"""Episodes: a start and a goal in an environment each, from a fixed list, so that every agent has the same."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError, did_you_mean


@dataclass(frozen=True)
class Episode:
    """One entry of an episode list (schema `episodes`): `number` is its place in it, from 0."""

    listed: Declaration
    number: int

    @property
    def data(self) -> Mapping[str, Any]:
        """The entry: `id`, `start_pose` (v2's 7 numbers), `goal`, `shortest_path_m`."""
        entry: Mapping[str, Any] = self.listed.data["episodes"][self.number]
        return entry

    @property
    def goal(self) -> Any:
        """The channel `goal`: float64 (2,) metres from the start pose, x forward; or a class; or what to fetch."""
        goal = self.data["goal"]
        if "fetch" in goal:
            return {"object": str(goal["fetch"]["class"]), "place": str(goal["place"]["class"])}
        if "class" in goal:
            return str(goal["class"])
        # Choosing an episode needs no numbers of its goal: numpy is imported where there are some.
        import numpy as np

        from benchbot.core.geometry import Pose

        x, y, z = goal["position"]
        seen = Pose.from_wxyz_xyz(self.data["start_pose"]).inverse() @ Pose((x, y, z))
        return np.array(seen.translation_xyz[:2], np.float64)

    def placed(self, scene: Declaration) -> Declaration:
        """Return the scene with the episode's start pose and places of objects instead of its own."""
        objects = {"loose_objects": self.data["objects"]} if "objects" in self.data else {}
        return replace(scene, data={**scene.data, "start_pose": list(self.data["start_pose"]), **objects})

    def provenance(self) -> dict[str, Any]:
        """Return what says which episode it is: the list's name and content hash, number and id."""
        return {
            "list": self.listed.name,
            "sha256": digest(self.listed.data),
            "number": self.number,
            "id": self.data["id"],
        }


def digest(episodes: Mapping[str, Any]) -> str:
    """Return the SHA-256 of an episode list's canonical JSON: keys sorted, no spaces."""
    return sha256(json.dumps(episodes, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def named_list(catalog: Catalog, chosen: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the episode list that a result's `provenance.selection.episode` names.

    Raises BenchbotError unless just that list is installed.
    """
    listed = catalog.get("episodes", chosen["list"]).data
    found = digest(listed)
    if found != chosen["sha256"] or chosen["number"] >= len(listed["episodes"]):
        raise BenchbotError(
            f"The episodes '{chosen['list']}' are not those of this result.",
            f"It is of the list with SHA-256 {chosen['sha256'][:12]}…, the installed one has {found[:12]}….",
            "Install the version of the plug-in that the result's provenance names, or run the episode again.",
        )
    return listed


def is_one_attempt(provenance: Mapping[str, Any]) -> bool:
    """Return whether a result's solution had no attempt before the last one, and was alone at it."""
    return not any(provenance.get(key) for key in ("restarts", "driven_by_hand", "taken_over"))


def choose(
    catalog: Catalog, task: Declaration, robot: Declaration, scene: Declaration, number: int | None
) -> Episode | None:
    """Return the episode of a task in a scene, the first one unless a number is given; None when the task has none.

    Raises BenchbotError for a number that there is not, for a scene without episodes and for a robot that is too wide.
    """
    wanted = task.data.get("episodes")
    if wanted is None:
        if number is None:
            return None
        raise BenchbotError(
            f"The task '{task.name}' has no episodes.",
            f"Episode {number} was asked for; the task starts where the environment says.",
            "Leave --episode out, or choose a task of navigation (benchbot list tasks).",
        )
    pool = catalog.pool("episodes")
    name = f"{wanted}:{scene.name}"
    if name not in pool:
        known = sorted(other.data["environment"] for other in pool.values() if other.data["task"] == wanted)
        raise BenchbotError(
            f"There are no episodes of the task '{task.name}' in '{scene.name}'.",
            f"There are some in: {', '.join(known) or 'none'}.{did_you_mean(scene.name, known)}",
            "Choose one of these environments, or make a list for this one: see docs/navigation.md",
        )
    listed = catalog.get("episodes", name)
    count = len(listed.data["episodes"])
    if not 0 <= (number or 0) < count:
        raise BenchbotError(
            f"There is no episode {number} in '{scene.name}'.",
            f"The list '{name}' has {count} episodes, 0 to {count - 1}.",
            f"Choose one of these: --episode {count - 1}",
        )
    radius_m = robot.data.get("footprint", {}).get("radius_m", 0.0)
    if radius_m > listed.data["robot_radius_m"]:
        raise BenchbotError(
            f"The robot '{robot.name}' is too wide for these episodes.",
            f"Its radius is {radius_m:g} m; the paths of '{name}' are for one of {listed.data['robot_radius_m']:g} m.",
            "Choose a smaller robot, or make a list for this one: see docs/navigation.md",
        )
    return Episode(listed, number or 0)
