"""A run and its progress as plain data, for clients (docs/wire.md)."""

from dataclasses import asdict
from typing import Any

from benchbot.core import results
from benchbot.core.channels import ACTIONS, OBSERVATIONS
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.progress import Progress
from benchbot.core.selection import Selection
from benchbot.core.session import Session


def selection_document(selection: Selection) -> dict[str, Any]:
    """Return what is run, without ground truth and seed; the commitment is None for a run without a secret."""
    return {
        "task": selection.task.data,
        "environments": [results.public_environment(scene) for scene in selection.environments],
        "robot": selection.robot.data,
        "results_format": _format_document(selection.results_format),
        "selection": {
            "task": selection.task.name,
            "robot": selection.robot.name,
            "environment": selection.environment,
            "commitment": selection.commitment,
            "episode": None if selection.episode is None else selection.episode.number,
            "settings": dict(selection.settings),
            "limits": asdict(selection.limits),
        },
        "observations": {name: OBSERVATIONS[name].value for name in selection.observations},
        "actions": {
            name: {"argument": ACTIONS[name].argument, "unit": ACTIONS[name].unit} for name in selection.actions
        },
    }


def progress_document(progress: Progress, *, with_pose: bool) -> dict[str, Any]:
    """Return where a run stands; the pose is the true one.

    Without it there is no robot's time either: who knows for how long a robot has held a speed knows how far it went.
    """
    spent = asdict(progress.spent)
    del spent["path_length_m"]  # the true one, as is the pose
    time_s = spent.pop("simulated_time_s")
    spent[progress.time_key] = time_s if with_pose else None
    return {
        "state": progress.state.value,
        "scene_number": progress.scene_number,
        "steps": progress.steps,
        "trajectory_index": progress.trajectory_index,
        "trajectory_length": progress.trajectory_length,
        "last_action": progress.last_action,
        "pose_xyyaw": list(progress.pose_xyyaw) if with_pose else None,
        progress.time_key: progress.simulated_time_s if with_pose else None,
        "wall_time_s": progress.wall_time_s,
        "frames": progress.frames,
        "spent": spent,
        "failure": None if progress.failure is None else progress.failure.value,
        "failure_why": progress.failure_why,
        "failure_fix": progress.failure_fix,
        "ends_run": progress.ends_run,
        "waiting_for": progress.waiting_for,
        "preparing": progress.preparing,
        "paused": progress.paused,
    }


def result_document(finished: dict[str, Any], *, with_pose: bool) -> dict[str, Any]:
    """Return a result as a solution may see it: without seed and secret, and without what tells the true way."""
    provenance = finished["provenance"]
    selection = {key: value for key, value in provenance["selection"].items() if key not in ("seed", "secret")}
    hidden = () if with_pose else ("spent", "track", "simulated_time_s", "robot_time_s")
    told = {key: value for key, value in provenance.items() if key not in hidden}
    return {
        **{key: value for key, value in finished.items() if key not in hidden},
        "provenance": {**told, "selection": selection},
    }


def state_document(session: Session) -> dict[str, Any]:
    """Return what every answer to a step says of the state, the time where the task tells true poses."""
    progress = session.progress
    tells_pose = session.selection.localisation == "ground_truth"
    return {
        "result": session.result,
        "available_actions": list(session.actions),
        "state": progress.state,
        "scene_number": progress.scene_number,
        "steps": progress.steps,
        progress.time_key: progress.simulated_time_s if tells_pose else None,
    }


def _format_document(declaration: Declaration | None) -> dict[str, Any] | None:
    if declaration is None:
        return None
    return {
        "name": declaration.name,
        "description": declaration.data.get("description", ""),
        "functions": sorted(declaration.data.get("functions", {})),
    }
