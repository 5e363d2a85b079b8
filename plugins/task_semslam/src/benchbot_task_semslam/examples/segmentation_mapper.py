"""A semantic mapper: boxes around objects, from depth, perfect segmentation and camera poses.

It solves semantic SLAM, and scene change detection by comparing the maps of two scenes; it follows the trajectory of a
passive task and looks once around in an active one.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, Agent, BenchBot, Observations
from benchbot.mapping import ObjectMap, changes, describe, describe_changes

LOOK_AROUND = 8


class SegmentationMapper(Agent):
    """A solution that follows the trajectory and maps the objects in its images."""

    def __init__(self) -> None:
        self._maps: dict[int, ObjectMap] = {}
        self._moves = 0

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the end of the trajectory, after a look around, or when the robot has hit something."""
        done = action_result is not ActionResult.SUCCESS or self._moves == LOOK_AROUND
        if done:
            self._moves = 0
        return done

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, float]]:
        """Map what is seen and go on."""
        self._maps.setdefault(observations["scene_number"], ObjectMap()).add(observations)
        if "move_next" in action_list:
            return "move_next", {}
        self._moves += 1
        return "move_angle", {"angle": 360 / LOOK_AROUND}

    def save_result(
        self,
        filename: str,
        empty_results: dict[str, Any],
        results_format_fns: Mapping[str, Callable[..., Any]],
    ) -> None:
        """Write the map of a scene, or what has changed from the first scene to the second."""
        results = empty_results["results"]
        scenes = [self._maps[number].objects for number in sorted(self._maps)]
        if "state_list" not in results:
            results["objects"] = [describe(item, results["class_list"]) for scene in scenes for item in scene]
        elif len(scenes) == 2:
            results["objects"] = describe_changes(changes(*scenes), results)
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


if __name__ == "__main__":
    BenchBot(agent=SegmentationMapper()).run()
