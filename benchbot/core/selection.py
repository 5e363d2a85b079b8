"""Selection: the task, robot and scenes of a run, or every reason why that run is not possible."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from benchbot.core import episodes, overrides, randomness
from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES, OBSERVATIONS
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import MEMBER_MARK, Catalog, Declaration
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.platform import Localisation
from benchbot.core.request import AUTO, NO_LIMITS, Limits, RunRequest
from benchbot.core.resources import YAML_SUFFIXES

V2_TYPES = ("sim_omni", "sim_unreal", "real")
"""Platforms of the robots and environments that v2 shipped."""


class ImpossibleError(BenchbotError):
    """Several reasons at once why a run is not possible."""

    def __init__(self, title: str, why: str, fix: str, reasons: Sequence[BenchbotError]) -> None:
        super().__init__(title, why, fix)
        self.reasons = tuple(reasons)


def all_of(what: str, errors: Sequence[BenchbotError]) -> BenchbotError:
    """Return the one error, or an ImpossibleError that numbers all reasons why `what` ("This run") is not possible."""
    if len(errors) == 1:
        return errors[0]
    reasons = "\n".join(f"{number}. {error.title} {error.why}" for number, error in enumerate(errors, 1))
    fixes = "\n".join(f"{number}. {error.fix}" for number, error in enumerate(errors, 1))
    return ImpossibleError(f"{what} is not possible, for {len(errors)} reasons.", reasons, fixes, errors)


@dataclass(frozen=True)
class Selection:
    """A possible run: a task on a robot in one scene or more, and the seed of everything stochastic.

    With an `episode`, the scene starts where that does. `settings` (dotted key to value) is what of the environments'
    declarations the run overrides; those in `environments` are as overridden.
    """

    task: Declaration
    robot: Declaration
    environments: tuple[Declaration, ...]
    results_format: Declaration | None
    seed: int = 0
    limits: Limits = NO_LIMITS
    episode: episodes.Episode | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    secret: str = field(default="", repr=False)
    despite: tuple[str, ...] = ()
    time_is_simulated: bool = True
    device: str = AUTO

    @property
    def environment(self) -> str:
        """The environment string: `name:variant[:variant…]`."""
        name = self.environments[0].data["name"]
        return ":".join([str(name), *(str(scene.data["variant"]) for scene in self.environments)])

    @property
    def request(self) -> RunRequest:
        """The request that this comes of, with the limits that the task sets; it names neither method nor recorders."""
        number = None if self.episode is None else self.episode.number
        what = (self.task.name, self.robot.name, self.environment, self.seed, number, self.settings, self.limits)
        return RunRequest(*what, secret=self.secret, despite=self.despite, device=self.device)

    @property
    def platform_options(self) -> dict[str, Any]:
        """The options of the simulator that whoever starts it has asked for."""
        return {} if self.device == AUTO else {"device": self.device}

    @property
    def commitment(self) -> str | None:
        """The commitment to its secret and seed, which anybody may know; None without a secret."""
        return randomness.commitment(self.secret, self.seed) if self.secret else None

    @property
    def localisation(self) -> Localisation:
        """The poses that the task reports: true ones, or those of drifting odometry."""
        return "noisy" if self.task.data.get("localisation") == "noisy" else "ground_truth"

    @property
    def observations(self) -> tuple[str, ...]:
        """The channels that the task gives to a solution, in the task's order."""
        return tuple(self.task.data["observations"])

    @property
    def actions(self) -> tuple[str, ...]:
        """The actions that the task allows, in the task's order."""
        return tuple(self.task.data["actions"])


def select(catalog: Catalog, request: RunRequest) -> Selection:
    """Return the selection asked for, or raise one BenchbotError that names every reason why it is impossible."""
    settings = overrides.normal(request.settings)
    errors: list[BenchbotError] = []

    def take(kind: str, name: str) -> Declaration | None:
        try:
            return catalog.get(kind, name)
        except BenchbotError as error:
            errors.append(error)
            return None

    task_found, robot_found = take("tasks", request.task), take("robots", request.robot)
    scenes: list[Declaration] = []
    try:
        scenes = [overrides.applied(scene, settings) for scene in catalog.environments(request.environment)]
    except BenchbotError as error:
        errors.append(error)
    results_format = None
    if task_found and "results_format" in task_found.data:
        results_format = take("formats", task_found.data["results_format"])

    if task_found and robot_found:
        errors += _capabilities(task_found, robot_found)
        errors += _unenforceable(catalog, robot_found, _limits(task_found, request.limits))
    if robot_found and scenes:
        errors += [error for scene in scenes for error in misfits(robot_found.data, scene)]
    if robot_found:
        errors += _runs(catalog, robot_found)
        errors += _undiagnosed(catalog, robot_found, request)
    if task_found and scenes:
        errors += _scenes(task_found, scenes)
    errors += _assets(catalog, scenes)
    if robot_found is None or "replay" not in robot_found.data:
        errors += _hidden(scenes, request)
    if request.method is not None:
        errors += _scoring(catalog, request.method, task_found)
    chosen = None
    if task_found and robot_found and scenes:
        try:
            chosen = episodes.choose(catalog, task_found, robot_found, scenes[0], request.episode)
        except BenchbotError as error:
            errors.append(error)
        else:
            scenes = scenes if chosen is None else [chosen.placed(scene) for scene in scenes]

    if errors or task_found is None or robot_found is None:
        raise all_of("This run", errors)
    limits = _limits(task_found, request.limits)
    what = (task_found, robot_found, tuple(scenes), results_format)
    # A robot behind a driver may be simulated, too, and tell its time on /clock.
    real = robot_found.data["type"] in catalog.plugins.pool("robot_drivers")
    real = real and not robot_found.data.get("driver", {}).get("use_sim_time", False)
    chosen_by = (request.secret, request.despite, not real, request.device)
    return Selection(*what, request.seed, limits, chosen, settings, *chosen_by)


def device_here(catalog: Catalog, selection: Selection) -> str | None:
    """Return the device that a run would be computed on here, in words; None where a simulator has no choice.

    Raises BenchbotError for a device that is not there, or that there is nothing to ask for.
    """
    simulator = catalog.plugins.pool("simulators").get(selection.robot.data["type"])
    if simulator is not None and simulator.value.device is not None:
        options = selection.environments[0].data.get("options", {})
        return str(simulator.value.device({**options, **selection.platform_options}))
    if selection.device != AUTO:
        raise BenchbotError(
            f"The robot '{selection.robot.name}' runs on no device that could be chosen.",
            "A device is what a simulator computes on, and not every simulator has a choice.",
            "Leave --device out.",
        )
    return None


def _capabilities(task: Declaration, robot: Declaration) -> Iterator[BenchbotError]:
    offered = set(robot.data["connections"]) | (GIVEN_BY_EPISODES if "episodes" in task.data else set())
    for kind, known in (("actions", ACTIONS), ("observations", OBSERVATIONS)):
        missing = [name for name in task.data[kind] if name not in offered]
        if missing:
            available = sorted(name for name in offered if name in known)
            yield BenchbotError(
                f"The robot '{robot.name}' does not offer the {kind} that the task '{task.name}' needs.",
                f"Missing: {', '.join(missing)}. It offers: {', '.join(available) or 'none'}.",
                "Choose another robot (benchbot list robots) or another task (benchbot list tasks).",
            )


def misfits(robot: Mapping[str, Any], scene: Declaration) -> Iterator[BenchbotError]:
    """Yield every reason why a robot, by its declaration's data, cannot be in a scene."""
    worlds = robot.get("runs_in", [robot["type"]])
    if scene.data["type"] not in worlds:
        yield BenchbotError(
            f"The robot '{robot['name']}' cannot run in the environment '{scene.name}'.",
            f"The robot runs in environments of type {' or '.join(worlds)}, this one is of type {scene.data['type']}.",
            "Choose a robot and an environment that fit; benchbot list robots shows the types.",
        )
    recorded = robot.get("replay", {scene.name: {"robot": robot["name"]}})
    if scene.name not in recorded:
        yield BenchbotError(
            f"The robot '{robot['name']}' cannot be in '{scene.name}': it was not recorded there.",
            f"There are recordings of: {', '.join(sorted(recorded))}.",
            "Choose one of these with --env, or name a recording of this scene, too: --recording FILE",
        )
        return
    driven = recorded[scene.name]["robot"]
    if scene.data.get("robots") and not {driven, driven.partition(MEMBER_MARK)[0]} & set(scene.data["robots"]):
        yield BenchbotError(
            f"The environment '{scene.name}' is not made for the robot '{robot['name']}'.",
            f"It names these robots: {', '.join(scene.data['robots'])}.",
            f"Choose one of them with --robot, or another environment than '{scene.name}'.",
        )


def _runs(catalog: Catalog, robot: Declaration) -> Iterator[BenchbotError]:
    kind = robot.data["type"]
    platforms = {**catalog.plugins.pool("simulators"), **catalog.plugins.pool("robot_drivers")}
    if kind in platforms:
        return
    title = f"Nothing installed can run robots of type '{kind}'."
    fix = f"Install it: benchbot install benchbot-{kind.replace('_', '-')}"
    if kind in V2_TYPES:
        title = f"The robot '{robot.name}' is of type '{kind}', which BenchBot v2 ran and this one does not."
        fix = "Choose a robot that runs here (benchbot list robots), and an environment for it: see docs/v2.md"
    known = ", ".join(sorted(platforms)) or "none"
    yield BenchbotError(title, f"Installed simulators and drivers: {known}.{catalog.plugins.broken_hint()}", fix)


def _undiagnosed(catalog: Catalog, robot: Declaration, request: RunRequest) -> Iterator[BenchbotError]:
    if request.despite and robot.data["type"] not in catalog.plugins.pool("robot_drivers"):
        yield BenchbotError(
            f"The robot '{robot.name}' is simulated: it has no diagnosis.",
            "--despite overrides a finding of a real robot's diagnosis.",
            "Leave --despite out.",
        )


def _unenforceable(catalog: Catalog, robot: Declaration, limits: Limits) -> Iterator[BenchbotError]:
    if limits.simulated_time_s is not None and robot.data["type"] in catalog.plugins.pool("robot_drivers"):
        yield BenchbotError(
            f"The robot '{robot.name}' has no simulated time that could be limited.",
            "Its time goes on while the solution thinks, as that of a real robot does.",
            "Limit real time: --max-wall-time SECONDS, or wall_time_s in the task's limits.",
        )


def _scenes(task: Declaration, scenes: list[Declaration]) -> Iterator[BenchbotError]:
    count = task.data.get("scene_count", 1)
    if len(scenes) != count:
        example = ":".join(["NAME", *("VARIANT" if count == 1 else f"VARIANT_{i}" for i in range(1, count + 1))])
        yield BenchbotError(
            f"The task '{task.name}' needs {count} scene{'s' if count > 1 else ''}, not {len(scenes)}.",
            f"You named: {', '.join(scene.name for scene in scenes)}.",
            f"Name the scenes like this: --env {example}",
        )
    if "move_next" in task.data["actions"]:
        for scene in scenes:
            if not scene.data.get("trajectory_poses"):
                yield BenchbotError(
                    f"The environment '{scene.name}' has no trajectory.",
                    f"The task '{task.name}' drives the robot along one with move_next.",
                    "Choose an active task, or an environment that declares trajectory_poses.",
                )


def _assets(catalog: Catalog, scenes: list[Declaration]) -> Iterator[BenchbotError]:
    furnished = [scene for scene in scenes if "assets" in scene.data]
    for scene in furnished:
        finished = _finished_scene(scene.path.parent / scene.data.get("map_path", "none"))
        if finished is not None:
            yield BenchbotError(
                f"The objects of '{scene.name}' cannot be taken from another asset pack.",
                f"Its scene is made from a finished one ({finished.name}), not a layout of models alone.",
                "Choose an environment whose map_path is a layout (.yaml), or leave 'assets' out.",
            )
    for name in sorted({scene.data["assets"] for scene in furnished}):
        packs = catalog.plugins.pool("asset_packs")
        if name not in packs:
            yield BenchbotError(
                f"There is no asset pack '{name}' here.",
                f"Installed: {', '.join(sorted(packs)) or 'none'}.{did_you_mean(name, list(packs))}"
                f"{catalog.plugins.broken_hint()}",
                f"See docs/assets.md for packs that can be installed: benchbot assets install {name}",
            )


def _hidden(scenes: list[Declaration], request: RunRequest) -> Iterator[BenchbotError]:
    for scene in scenes:
        if scene.data.get("hidden") and not request.secret:
            yield BenchbotError(
                f"The place '{scene.name}' is hidden, and the run has no secret.",
                "Its noise could be worked out: all that is random would be drawn from the seed alone.",
                "Give the run one: --secret FILE, or --secret random",
            )


def _finished_scene(path: Path) -> Path | None:
    """Return the file that a scene is, or that its layout is based on, in the end; None for a layout without."""
    passed: list[Path] = []
    while path.suffix in YAML_SUFFIXES and path not in passed and path.is_file():
        passed.append(path)
        base = schema.read(path).get("base")
        if base is None:
            return None
        path = path.parent / str(base)
    return None if path.suffix in YAML_SUFFIXES else path


def _scoring(catalog: Catalog, method: str, task: Declaration | None) -> Iterator[BenchbotError]:
    try:
        evaluator = catalog.plugins.record("evaluators", method)
    except BenchbotError as error:
        yield error
        return
    if task is None:
        return
    results_format = task.data.get("results_format")
    if results_format not in evaluator.result_formats:
        yield BenchbotError(
            f"The method '{method}' cannot score results of the task '{task.name}'.",
            f"The task's results have the format '{results_format}'; "
            f"the method reads: {', '.join(sorted(evaluator.result_formats))}.",
            "Choose another method with --evaluate-with, or leave scoring out.",
        )


def _limits(task: Declaration, asked: Limits) -> Limits:
    """Return the task's own limits, tightened or loosened by what the user asked for."""
    declared = task.data.get("limits", {})
    limits = asdict(asked).items()
    return Limits(**{name: declared.get(name) if limit is None else limit for name, limit in limits})
