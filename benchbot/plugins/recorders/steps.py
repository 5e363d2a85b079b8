"""The recorder `steps`: a line of JSON for each observation and the action that led to it, without images."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.plugins.recorders.files import LineFile

if TYPE_CHECKING:
    from benchbot.core.channels import Observations
    from benchbot.core.progress import Progress, Step

FILE = "steps.jsonl"
BASE = "base_link"


class StepsRecording:
    """Writes `steps.jsonl`: action, outcome, times, observed pose, and a digest of the observations.

    The true pose is not in it where the task hides it: a solution might read the file.
    """

    def __init__(self, folder: Path) -> None:
        self._lines = LineFile("steps", folder / FILE)

    def reset(self) -> None:
        """Start over."""
        self._lines.restart()

    def step(self, action: str | None, arguments: Mapping[str, float], step: "Step", progress: "Progress") -> None:
        """Write one line."""
        from benchbot.core.digest import ObservationDigest

        digest = ObservationDigest()
        digest.update(step.observations)
        line = {
            "observation": progress.frames,
            "scene": step.scene_number,
            "action": action,
            "arguments": dict(arguments),
            "outcome": step.outcome,
            "result": step.result,
            "state": step.state,
            "steps": progress.steps,
            progress.time_key: progress.simulated_time_s,
            "wall_time_s": round(progress.wall_time_s, 6),
            "pose": _pose(step.observations),
            "failure": progress.failure,
            "sha256": digest.hexdigest(),
        }
        self._lines.add(json.dumps(line))

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


def _pose(observations: "Observations") -> dict[str, list[float]] | None:
    """Return the pose of the robot's base as the solution observed it."""
    pose = observations.get("poses", {}).get(BASE)
    if pose is None:
        return None
    return {name: [float(value) for value in pose[name]] for name in ("translation_xyz", "rotation_xyzw")}
