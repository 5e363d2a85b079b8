"""The example `segmentation_mapper` with less to see: every Nth picture, or nothing beyond some metres."""

import argparse
from collections.abc import Sequence

import numpy as np

from benchbot.api import BenchBot, Observations
from benchbot_task_semslam.examples.segmentation_mapper import SegmentationMapper


class PartialMapper(SegmentationMapper):
    """A mapper that leaves out pictures, and depth."""

    def __init__(self, every: int, farthest_m: float) -> None:
        super().__init__()
        self._every, self._farthest_m = every, farthest_m
        self._count = -1

    def pick_action(self, observations: Observations, action_list: Sequence[str]) -> tuple[str, dict[str, float]]:
        """Map one picture of `every`, without its depth beyond `farthest_m`."""
        self._count += 1
        depth_m = observations["image_depth"]
        is_kept = (depth_m <= self._farthest_m) & (self._count % self._every == 0)
        observations["image_depth"] = np.where(is_kept, depth_m, np.float32(np.inf))
        return super().pick_action(observations, action_list)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--farthest", type=float, default=np.inf)
    options = parser.parse_args()
    BenchBot(agent=PartialMapper(options.every, options.farthest)).run()
