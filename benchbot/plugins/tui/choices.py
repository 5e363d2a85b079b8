"""Tasks, robots and environments to choose from: the reasons against each, and its facts."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, islice, permutations
from typing import Any

from benchbot.core.channels import ACTIONS, OBSERVATIONS
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError
from benchbot.core.request import RunRequest
from benchbot.core.selection import ImpossibleError, select

Rows = list[tuple[str, str]]

MOST_ENVIRONMENTS = 500
"""A task of several scenes can take place in any order of variants. So many are offered; a shell takes them all."""


@dataclass(frozen=True)
class Choice:
    """A task, robot or environment, and every reason against it; it is possible when there is none."""

    name: str
    reasons: tuple[BenchbotError, ...] = ()


class CachingCatalog(Catalog):
    """A catalog that validates each declaration only once."""

    def __init__(self, catalog: Catalog) -> None:
        super().__init__(catalog.plugins)
        self._checked: dict[tuple[str, str], Declaration | BenchbotError] = {}

    def get(self, kind: str, name: str) -> Declaration:
        """Return a validated declaration; raises BenchbotError as the first time."""
        found = self._checked.get((kind, name))
        if found is None:
            try:
                found = super().get(kind, name)
            except BenchbotError as error:
                found = error
            self._checked[kind, name] = found
        if isinstance(found, BenchbotError):
            raise found
        return found


class Possibilities:
    """The possible runs, one choice after the other: the task, then the robot, then the environment."""

    def __init__(self, catalog: Catalog) -> None:
        self.catalog = CachingCatalog(catalog)
        self._known: dict[tuple[str, str, str], tuple[BenchbotError, ...]] = {}

    def tasks(self) -> list[Choice]:
        """Return all tasks; one is possible when some robot can do it in some environment."""
        return [Choice(task, self._against_task(task)) for task in self.catalog.names("tasks")]

    def robots(self, task: str) -> list[Choice]:
        """Return all robots; one is possible when it can do the task in some environment."""
        return [Choice(robot, self._against_robot(task, robot)) for robot in self.catalog.names("robots")]

    def environments(self, task: str, robot: str) -> list[Choice]:
        """Return all environments, of as many scenes as the task has."""
        return [Choice(name, self.against(task, robot, name)) for name in self.environment_names(task)]

    def environment_names(self, task: str) -> list[str]:
        """Return `NAME:VARIANT`, or `NAME:VARIANT:VARIANT` for a task of two scenes, and so on."""
        names = self.catalog.names("environments")
        try:
            count = self.catalog.get("tasks", task).data.get("scene_count", 1)
        except BenchbotError:
            count = 1
        return names if count == 1 else list(islice(_scene_orders(names, count), MOST_ENVIRONMENTS))

    def against(self, task: str, robot: str, environment: str) -> tuple[BenchbotError, ...]:
        """Return every reason why a combination is impossible."""
        key = (task, robot, environment)
        if key not in self._known:
            self._known[key] = self._select(*key)
        return self._known[key]

    def _select(self, task: str, robot: str, environment: str) -> tuple[BenchbotError, ...]:
        try:
            select(self.catalog, RunRequest(task, robot, environment))
        except ImpossibleError as error:
            return error.reasons
        except BenchbotError as error:
            return (error,)
        return ()

    def _against_robot(self, task: str, robot: str) -> tuple[BenchbotError, ...]:
        return _fewest(self.against(task, robot, name) for name in self.environment_names(task))

    def _against_task(self, task: str) -> tuple[BenchbotError, ...]:
        return _fewest(self._against_robot(task, robot) for robot in self.catalog.names("robots"))


def facts(declaration: Declaration) -> Rows:
    """Return labels and values, the description first. Nothing of the ground truth is among them."""
    rows_of = {"tasks": _task, "robots": _robot, "environments": _environment, "examples": _example}
    description = " ".join(str(declaration.data.get("description", "")).split())
    rows = rows_of[declaration.kind](declaration.data)
    return [("", description), *[(label, value) for label, value in rows if value], ("From", declaration.distribution)]


def field_of_view_deg(camera: Mapping[str, Any]) -> float | None:
    """Return the horizontal field of view of a camera, None where its declaration lacks the numbers."""
    if "fx" not in camera or "width" not in camera:
        return None
    return math.degrees(2 * math.atan(camera["width"] / (2 * camera["fx"])))


def _scene_orders(names: Sequence[str], count: int) -> Iterator[str]:
    for environment, group in groupby(names, lambda name: name.split(":")[0]):
        variants = [name.split(":")[1] for name in group]
        yield from (":".join([environment, *scenes]) for scenes in permutations(variants, count))


def _fewest(all_reasons: Iterator[tuple[BenchbotError, ...]]) -> tuple[BenchbotError, ...]:
    """Return no reason when one combination is possible, else the fewest reasons against any."""
    fewest: tuple[BenchbotError, ...] | None = None
    for reasons in all_reasons:
        if not reasons:
            return ()
        if fewest is None or len(reasons) < len(fewest):
            fewest = reasons
    return fewest or (
        BenchbotError("There is nothing to run it with.", "No robot or environment is installed.", "Install some."),
    )


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
    resolution = ""
    if "width" in camera and "height" in camera:
        angle = field_of_view_deg(camera)
        resolution = f"{camera['width']} × {camera['height']}" + ("" if angle is None else f", {angle:.0f}° wide")
    reach = laser.get("range_m") or [None, None]
    return [
        ("Type", str(data.get("type", ""))),
        ("Actions", _names(name for name in connections if name in ACTIONS)),
        ("Observations", _names(name for name in connections if name in OBSERVATIONS and not name.endswith("_info"))),
        ("Camera", resolution),
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


def _names(names: Any) -> str:
    return ", ".join(map(str, names or ()))
