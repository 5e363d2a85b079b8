"""What a person should know of a task, robot, environment or example before choosing it, in rows."""

import math
from collections.abc import Mapping
from typing import Any

from benchbot.core.channels import ACTIONS, OBSERVATIONS
from benchbot.core.declarations.catalog import Declaration

Rows = list[tuple[str, str]]


def facts(declaration: Declaration) -> Rows:
    """Return labels and values, the description first. Nothing of the ground truth is among them."""
    told = {"tasks": _task, "robots": _robot, "environments": _environment, "examples": _example}
    description = " ".join(str(declaration.data.get("description", "")).split())
    rows = told[declaration.kind](declaration.data)
    return [("", description), *[(label, value) for label, value in rows if value], ("From", declaration.distribution)]


def _task(data: Mapping[str, Any]) -> Rows:
    limits = data.get("limits") or {}
    return [
        ("Actions", _names(data.get("actions"))),
        ("Observations", _names(data.get("observations"))),
        ("Poses", "drifting odometry" if data.get("localisation") == "noisy" else "true"),
        ("Scenes", str(data.get("scene_count", 1))),
        ("Episodes", str(data.get("episodes", ""))),
        ("Results", str(data.get("results_format") or "any JSON")),
        ("Scored by", str(data.get("evaluation_method") or "")),
        ("Limits", ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in limits.items())),
    ]


def _robot(data: Mapping[str, Any]) -> Rows:
    connections = list(data.get("connections") or ())
    camera, laser = data.get("camera") or {}, data.get("laser") or {}
    footprint, limits = data.get("footprint") or {}, data.get("limits") or {}
    seen = ""
    if "width" in camera and "height" in camera:
        angle = field_of_view_deg(camera)
        seen = f"{camera['width']} × {camera['height']}" + ("" if angle is None else f", {angle:.0f}° wide")
    reach = laser.get("range_m") or [None, None]
    return [
        ("Type", str(data.get("type", ""))),
        ("Actions", _names(name for name in connections if name in ACTIONS)),
        ("Observations", _names(name for name in connections if name in OBSERVATIONS and not name.endswith("_info"))),
        ("Camera", seen),
        ("Laser", f"{laser['beams']} beams, up to {reach[1]:g} m" if "beams" in laser and reach[1] else ""),
        ("Radius", f"{footprint['radius_m']:g} m" if "radius_m" in footprint else ""),
        ("Speed", f"up to {limits['linear_mps'][1]:g} m/s" if "linear_mps" in limits else ""),
    ]


def _environment(data: Mapping[str, Any]) -> Rows:
    start = data.get("start_pose") or []
    where = f"({float(start[4]):.2f}, {float(start[5]):.2f}) m" if len(start) == 7 else ""
    return [
        ("Type", str(data.get("type", ""))),
        ("Starts at", where),
        ("Trajectory", f"{len(data['trajectory_poses'])} poses" if data.get("trajectory_poses") else "none"),
        ("Only for", _names(data.get("robots"))),
        ("Classes", _names(data.get("object_labels"))),
    ]


def _example(data: Mapping[str, Any]) -> Rows:
    return [("Command", str(data.get("native_command", "")))]


def field_of_view_deg(camera: Mapping[str, Any]) -> float | None:
    """Return how wide a camera of a robot's declaration sees, None where it does not say so."""
    if "fx" not in camera or "width" not in camera:
        return None
    return math.degrees(2 * math.atan(camera["width"] / (2 * camera["fx"])))


def _names(names: Any) -> str:
    return ", ".join(map(str, names or ()))
