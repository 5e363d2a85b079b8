"""A semantic mapper that sees: boxes around objects, from colours, depth and camera poses.

A segmenter says of each pixel how likely it is of which class; depth lifts it into a map of voxels, where all views of
a voxel are averaged; touching voxels of one class are an object. It follows the trajectory of a passive task and looks
once around in an active one. weights=FILE has it see with another network, an ONNX file of the form that
`benchbot_baselines.segmenter.Segmenter` says.
"""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.api import ActionResult, Agent, BenchBot, BenchbotError, Observations
from benchbot.mapping import describe
from benchbot_baselines.fusion import ClassMap
from benchbot_baselines.segmenter import WEIGHTS, Segmenter

LOOK_AROUND = 8


class PerceptionMapper(Agent):
    """A solution that follows the trajectory and maps the objects that its segmenter sees."""

    def __init__(self, segmenter: Segmenter) -> None:
        self._segmenter = segmenter
        self._maps: dict[int, ClassMap] = {}
        self._moves = 0

    def is_done(self, action_result: ActionResult) -> bool:
        """Stop at the end of the trajectory, after a look around, or when the robot has hit something."""
        done = action_result is not ActionResult.SUCCESS or self._moves == LOOK_AROUND
        if done:
            self._moves = 0
        return done

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, float]]:
        """Map what is seen and go on."""
        empty = ClassMap(self._segmenter.class_list)
        self._maps.setdefault(observations["scene_number"], empty).add(self._segmenter.see(observations))
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
        """Write the objects of the map, each with the probabilities of all classes."""
        results = empty_results["results"]
        found = [item for number in sorted(self._maps) for item in self._maps[number].objects()]
        results["objects"] = [describe(item, results["class_list"]) for item in found]
        Path(filename).write_text(json.dumps(empty_results), encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", nargs="?", metavar="weights=FILE", help="another segmenter, an ONNX file")
    named = parser.parse_args().weights
    file = WEIGHTS if named is None else Path(named.removeprefix("weights="))
    try:
        segmenter = Segmenter(file)
    except BenchbotError as error:
        raise SystemExit(str(error)) from None
    BenchBot(agent=PerceptionMapper(segmenter)).run()
