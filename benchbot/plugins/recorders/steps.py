"""The recorder `steps`: a line of JSON for each observation, with what led to it and what it was, but no pictures."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.plugins.recorders.faults import told
from benchbot.plugins.recorders.lines import LineFile

if TYPE_CHECKING:
    from benchbot.core.progress import Progress, Step

FILE = "steps.jsonl"
BASE = "base_link"


class StepsRecording:
    """Writes `steps.jsonl`: what was done, what came of it, when, where as observed, and a digest of what was seen.

    The true pose is not in it where the task hides it: a solution might read the file.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        with told("steps", folder):
            self._lines = LineFile(folder / FILE)

    def reset(self) -> None:
        """Start over."""
        with told("steps", self._folder):
            self._lines.restart()

    def step(self, action: str | None, arguments: Mapping[str, Any], step: "Step", progress: "Progress") -> None:
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
            "simulated_time_s": progress.simulated_time_s,
            "wall_time_s": round(progress.wall_time_s, 6),
            "pose": _pose(step.observations),
            "failure": progress.failure,
            "sha256": digest.hexdigest(),
        }
        with told("steps", self._folder):
            self._lines.add(json.dumps(line))

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


def _pose(observations: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return where the solution was told that the robot's base is."""
    pose = observations.get("poses", {}).get(BASE)
    if pose is None:
        return None
    return {name: [float(value) for value in pose[name]] for name in ("translation_xyz", "rotation_xyzw")}
