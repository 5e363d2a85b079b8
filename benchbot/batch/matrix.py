"""From what is asked to a plan: every combination of the axes, each proven possible, with the key of its result."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from itertools import product
from pathlib import Path
from typing import Any

from benchbot.batch.plan import Plan, PlannedEpisode, PlannedSolution, canonical, digest, plan_hash
from benchbot.batch.request import Request
from benchbot.core import overrides
from benchbot.core.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.provenance import files_named, software
from benchbot.core.selection import ImpossibleError, Selection, select
from benchbot.submission.episode import Order
from benchbot.submission.ordering import order_of, split_words

LABEL_LENGTH = 100
BESIDE_LIMIT = 500
"""How many Python files beside a solution's are hashed at most: beyond that it is no solution's folder."""


def make(request: Request, catalog: Catalog, folder: Path) -> Plan:
    """Return the plan of a batch whose native solution runs in `folder`.

    Raises one BenchbotError that names all reasons why some combination is impossible.
    """
    order = order_of(catalog, request.native, request.example, list(request.words), request.timeout_s)
    order = replace(order, folder=folder) if request.native is not None else order
    for name in request.record:
        catalog.plugins.record("recorders", name)
    solution = PlannedSolution(
        request.native, request.example, tuple(request.words), str(folder), dict(_files(order.command, order.folder))
    )
    selections = _selections(request, catalog)
    shared = {
        "task": request.task,
        "limits": asdict(request.limits),
        "timeout_s": request.timeout_s,
        "solution": {"command": order.command, "files": dict(solution.files)},
    }
    episodes = tuple(_episodes(request, selections, shared))
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
    )


def order_for(plan: Plan, catalog: Catalog) -> Order:
    """Return what is run in each episode of a plan; raises BenchbotError when its command is not there."""
    solution = plan.solution
    if solution.native is None:
        return order_of(catalog, None, solution.example, list(solution.words), plan.timeout_s)
    words = [*split_words("--native", solution.native), *solution.words]
    return Order(words, Path(solution.folder), timeout_s=plan.timeout_s)


def select_for(plan: Plan, episode: PlannedEpisode, catalog: Catalog) -> Selection:
    """Return what an episode runs; raises BenchbotError when that is not possible here."""
    return select(
        catalog,
        task=plan.task,
        robot=episode.robot,
        environment=episode.environment,
        seed=episode.seed,
        limits=plan.limits,
        episode=episode.episode,
        settings=episode.settings,
    )


Combination = tuple[str, str, dict[str, Any], int | None]
"""What differs between selections beside their seeds: robot, environment, settings and episode."""


def _selections(request: Request, catalog: Catalog) -> list[tuple[Combination, Selection]]:
    found: list[tuple[Combination, Selection]] = []
    errors: dict[tuple[str, str], BenchbotError] = {}
    for combination in _combinations(request):
        robot, environment, settings, episode = combination
        try:
            selection = select(
                catalog,
                task=request.task,
                robot=robot,
                environment=environment,
                method=request.method,
                limits=request.limits,
                episode=episode,
                settings=settings,
            )
        except BenchbotError as error:
            for reason in error.reasons if isinstance(error, ImpossibleError) else [error]:
                errors.setdefault((reason.title, reason.why), reason)
        else:
            found.append((combination, selection))
            if selection.robot.data["type"] in catalog.plugins.pool("robot_drivers"):
                errors.setdefault((robot, ""), _real(robot))
    if len(errors) == 1:
        raise next(iter(errors.values()))
    if errors:
        raise BenchbotError(
            f"This batch is not possible, for {len(errors)} reasons.",
            "\n".join(f"{number}. {error.title} {error.why}" for number, error in enumerate(errors.values(), 1)),
            "\n".join(f"{number}. {error.fix}" for number, error in enumerate(errors.values(), 1)),
        )
    return found


def _real(robot: str) -> BenchbotError:
    return BenchbotError(
        f"The robot '{robot}' is a real one.",
        "A batch runs unattended and tries again what has failed; somebody must stand beside a robot that moves.",
        "Run its episodes one by one: benchbot submit",
    )


def _combinations(request: Request) -> Iterator[Combination]:
    """Yield what shares a simulator's scene one after the other, so that workers stay where they are."""
    axes = [[(key, value) for value in values] for key, values in request.settings.items()]
    for robot, environment, settings in product(request.robots, request.environments, product(*axes)):
        for episode in request.episodes if request.episodes is not None else [None]:
            yield robot, environment, dict(settings), episode


def _episodes(
    request: Request, selections: list[tuple[Combination, Selection]], shared: dict[str, Any]
) -> Iterator[PlannedEpisode]:
    known: dict[str, dict[str, Any]] = {}
    for (robot, environment, settings, _), selection in selections:
        place = canonical([robot, environment, settings])
        if place not in known:
            known[place] = software(selection)
        number = None if selection.episode is None else selection.episode.number
        for seed, repeat in product(request.seeds, range(request.repeats)):
            counted = repeat if request.repeats > 1 else None
            determines = {
                **shared,
                **known[place],
                "robot": robot,
                "environment": environment,
                "settings": settings,
                "seed": seed,
                "repeat": counted,
                "episode": None if selection.episode is None else selection.episode.provenance(),
                "limits": asdict(selection.limits),
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


def _files(command: list[str], folder: Path) -> Iterator[tuple[str, str]]:
    """Yield name and SHA-256 of the files that a command names, and of the Python files in the folders of these."""
    named = files_named(command, folder)
    yield from named.items()
    for script in (word for word in named if word.endswith(".py")):
        around = (folder / script).parent
        beside = sorted(path for path in around.glob("*.py") if path.is_file())
        if len(beside) <= BESIDE_LIMIT:
            for name, content in files_named(["", *(path.name for path in beside)], around).items():
                yield str(Path(script).parent / name), content
