"""The format `floor_plan`: clearances at the nodes of a grid."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchbot_task_navigation.floor_plan import FloorPlan


def create(origin: Sequence[float], resolution_m: float, clearance_m: Sequence[Sequence[float]]) -> dict[str, Any]:
    """Return a floor plan from the clearance [i][j] in metres at origin + resolution_m * (i, j) in the map frame."""
    plan = FloorPlan((float(origin[0]), float(origin[1])), resolution_m, np.asarray(clearance_m, np.float64))
    return plan.as_ground_truth()


def validate(plan: dict[str, Any]) -> None:
    """Raise BenchbotError unless this is a floor plan."""
    FloorPlan.from_ground_truth(plan)
