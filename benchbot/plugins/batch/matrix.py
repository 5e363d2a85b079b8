"""From a request to a plan: every combination of the axes, each proven possible, with the key of its result."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from benchbot.core import overrides
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.provenance import software
from benchbot.core.request import RunRequest, canonical, digest
from benchbot.core.selection import ImpossibleError, Selection, all_of, device_here, select
from benchbot.plugins.batch import solutions
from benchbot.plugins.batch.plan import Plan, PlannedEpisode, PlannedSolution, plan_hash
from benchbot.plugins.batch.request import BatchRequest
from benchbot.plugins.batch.source_files import SourceFiles
from benchbot.submission.modes import spec_of

LABEL_LENGTH = 100


def make(request: BatchRequest, catalog: Catalog, folder: Path) -> tuple[Plan, SourceFiles]:
    """Return the plan of a batch whose native solution runs in `folder`, and the files of the solution.

    Raises one BenchbotError that names all reasons why some combination is impossible.
    """
    solution = PlannedSolution(
        request.native, request.example, tuple(request.words), str(folder), {}, request.hold, tuple(request.source)
    )
    command, ran_in = command_of(solution, catalog)
    for name in request.record:
        catalog.plugins.record("recorders", name)
    files = solutions.files(command, ran_in, solution)
    solution = replace(solution, files=files.content.files, snapshot=files.content.hash)
    return plan_of(request, solution, command, selections(request, catalog)), files


def plan_of(
    request: BatchRequest,
    solution: PlannedSolution,
    command: Sequence[str],
    possible: "Sequence[tuple[Combination, Selection]]",
) -> Plan:
    """Return the plan of a request whose solution, its command and its selections are known."""
    shared = {
        "timeout_s": request.timeout_s,
        "solution": {"command": list(command), "snapshot": solution.snapshot, **request.hold.determines()},
    }
    episodes = tuple(_episodes(request, possible, shared))
    return Plan(
        hash=plan_hash(episodes),
        task=request.task,
        method=request.method,
        solution=solution,
        limits=request.limits,
        timeout_s=request.timeout_s,
        record=tuple(dict.fromkeys(request.record)),
        policy=request.policy,
        episodes=episodes,
        secret=request.secret,
        device=request.device,
    )


def edited(plan: Plan, catalog: Catalog) -> list[str]:
    """Return the files of a plan's solution that are not what they were; none where they cannot be looked at."""
    changed: set[str] = set()
    for solution in plan.all_solutions.values():
        with suppress(BenchbotError, OSError):
            before, now = solution.files, solutions.files(*command_of(solution, catalog), solution).content.files
            changed |= {name for name in {*before, *now} if before.get(name) != now.get(name)}
    return sorted(changed)


def command_of(solution: PlannedSolution, catalog: Catalog) -> tuple[list[str], Path]:
    """Return the command, and where it runs; the command of a container is in its image."""
    if solution.hold.context is not None:
        return [solutions.IMAGE, *solution.words], Path(solution.folder)
    spec = spec_of(catalog, solution.native, solution.example, list(solution.words), timeout_s=None)
    return spec.command, Path(solution.folder) if solution.native is not None else spec.folder


def select_for(plan: Plan, episode: PlannedEpisode, catalog: Catalog) -> Selection:
    """Return the selection of an episode; raises BenchbotError when it is not possible here."""
    return select(catalog, plan.request_of(episode))


def device_of(plan: Plan, catalog: Catalog) -> str | None:
    """Return what the first episode would be simulated on here, in words; raises BenchbotError as `select` does."""
    return device_here(catalog, select_for(plan, plan.episodes[0], catalog))


Combination = tuple[str, str, dict[str, Any], int | None]
"""Robot, environment, settings and episode: selections differ in these, beside their seeds."""


def selections(request: BatchRequest, catalog: Catalog) -> list[tuple[Combination, Selection]]:
    """Return what each combination selects; raises BenchbotError that names all reasons why some are impossible."""
    found: list[tuple[Combination, Selection]] = []
    errors: dict[tuple[str, str], BenchbotError] = {}
    for combination in _combinations(request):
        robot, environment, settings, episode = combination
        try:
            selection = select(
                catalog,
                RunRequest(
                    task=request.task,
                    robot=robot,
                    environment=environment,
                    method=request.method,
                    limits=request.limits,
                    episode=episode,
                    settings=settings,
                    secret=request.secret,
                    device=request.device,
                ),
            )
        except BenchbotError as error:
            for reason in error.reasons if isinstance(error, ImpossibleError) else [error]:
                errors.setdefault((reason.title, reason.why), reason)
        else:
            found.append((combination, selection))
            if selection.robot.data["type"] in catalog.plugins.pool("robot_drivers"):
                real = BenchbotError(
                    f"The robot '{robot}' is a real one.",
                    "A batch runs unattended and tries again what has failed; "
                    "somebody must stand beside a robot that moves.",
                    "Run its episodes one by one: benchbot submit",
                )
                errors.setdefault((robot, ""), real)
    if errors:
        raise all_of("This batch", list(errors.values()))
    return found


def _combinations(request: BatchRequest) -> Iterator[Combination]:
    """Yield combinations of one scene one after the other, so that workers stay in the scene that is loaded."""
    axes = [[(key, value) for value in values] for key, values in request.settings.items()]
    for robot, environment, settings in product(request.robots, request.environments, product(*axes)):
        for episode in request.episodes if request.episodes is not None else [None]:
            yield robot, environment, dict(settings), episode


def _episodes(
    request: BatchRequest, selections: Sequence[tuple[Combination, Selection]], shared: dict[str, Any]
) -> Iterator[PlannedEpisode]:
    known: dict[bytes, dict[str, Any]] = {}
    for (robot, environment, settings, _), selection in selections:
        scene = canonical([robot, environment, settings])
        if scene not in known:
            known[scene] = software(selection)
        number = None if selection.episode is None else selection.episode.number
        for seed, repeat in product(request.seeds, range(request.repeats)):
            counted = repeat if request.repeats > 1 else None
            determines = {
                **shared,
                **known[scene],
                "request": replace(selection.request, seed=seed).determining(),
                "repeat": counted,
                "episode": None if selection.episode is None else selection.episode.provenance(),
            }
            label = _label(robot, environment, seed, counted, number, settings)
            yield PlannedEpisode(digest(determines), label, robot, environment, seed, counted, number, settings)


def _label(
    robot: str, environment: str, seed: int, repeat: int | None, number: int | None, settings: Mapping[str, Any]
) -> str:
    told = (("episode", number), ("seed", seed), ("repeat", repeat))
    parts = [robot, environment.replace(":", "-"), *(f"{word}{value}" for word, value in told if value is not None)]
    if settings:
        parts.append(overrides.label(settings).replace(", ", "_"))
    return re.sub(r"[^\w.=-]", "-", "_".join(parts))[:LABEL_LENGTH]
