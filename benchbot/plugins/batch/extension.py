"""Adding seeds to a batch that was begun: more episodes of the same, with the solutions that it has kept."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Display, Json
from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch.following import Archive, Detach, Directory, Jobs, go_on

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.plugins.batch.plan import Plan
    from benchbot.plugins.batch.request import BatchRequest


def extend(
    directory: Directory,
    seeds: Annotated[str, typer.Option("--seeds", "--seed", metavar="3..5", help="The seeds to add: 3..5 or 7,9.")],
    jobs: Jobs = None,
    archive: Archive = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show what would be computed, and end.")] = False,
    detach: Detach = False,
    display: Display = "auto",
    as_json: Json = False,
) -> None:
    """Add seeds to a batch and compute them; what is finished stays, and the solution is the one that it kept."""
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.batch import driver
    from benchbot.plugins.batch import plan as plans
    from benchbot.plugins.batch.folder import Folder, prepare, preview
    from benchbot.plugins.batch.request import numbers

    folder, catalog = Folder(directory.absolute()), Catalog(load())
    plan = extended(plans.read(folder.plan), numbers("--seeds", seeds), catalog)
    if dry_run:
        found = preview(folder, plan)
        if as_json:
            done = {each.key for each in found.done}
            rows = [{"episode": each.name, "done": each.key in done} for each in plan.episodes]
            console.data_json({"folder": str(folder.path), "hash": plan.hash, "episodes": rows})
        console.note(*found.lines)
        return
    # Workers have read the plan before: they are ended, and what they were computing is begun again.
    console.note(*prepare(folder, plan, update=True, keep=lambda: driver.end_workers(folder)).lines)
    go_on(directory, jobs, archive=archive, detach=detach, display=display, as_json=as_json)


def extended(plan: "Plan", seeds: Sequence[int], catalog: "Catalog") -> "Plan":
    """Return a plan with all its episodes and the same ones with more seeds, as one command would have planned them.

    Raises BenchbotError when there is nothing to add, and when what determines results is not what it was.
    """
    from benchbot.plugins.batch import matrix
    from benchbot.plugins.batch.solution_axis import combined

    before = list(dict.fromkeys(each.seed for each in plan.episodes))
    added = [seed for seed in seeds if seed not in before]
    if not added:
        raise BenchbotError(
            "There is no seed to add.",
            f"The batch has them already: {shown(before)}.",
            f"Name others: --seeds {max(before) + 1}..{max(before) + len(before)}",
        )
    requests = {name: _request_of(alone, [*before, *added]) for name, alone in plan.each().items()}
    possible = matrix.selections(next(iter(requests.values())), catalog)
    parts: dict[str | None, Plan] = {}
    for name, alone in plan.each().items():
        command, _ = matrix.command_of(alone.solution, catalog)
        parts[name] = matrix.plan_of(requests[name], alone.solution, command, possible)
    whole = parts[None] if None in parts else combined({str(name): part for name, part in parts.items()})
    lost = {each.key for each in plan.episodes} - {each.key for each in whole.episodes}
    if lost:
        raise BenchbotError(
            "The episodes to add would not be like those that are there.",
            f"What determines their results has changed since: BenchBot, a plug-in, an environment, or an example "
            f"({len(lost)} of {len(plan.episodes)} episodes would be computed otherwise now).",
            "Install what there was then, or compute all of them anew, in another folder: benchbot batch …",
        )
    return replace(plan, hash=whole.hash, episodes=whole.episodes)


def next_seeds(plan: "Plan") -> str:
    """Return as many seeds as a batch has, those after its last one, as `--seeds` has them."""
    seeds = {each.seed for each in plan.episodes}
    first, last = max(seeds) + 1, max(seeds) + len(seeds)
    return str(first) if first == last else f"{first}..{last}"


def _request_of(plan: "Plan", seeds: Sequence[int]) -> "BatchRequest":
    """Return the request that a plan of one solution came from, with these seeds."""
    from benchbot.core.request import canonical
    from benchbot.plugins.batch.request import BatchRequest

    settings: dict[str, dict[bytes, Any]] = {}
    for episode in plan.episodes:
        for key, value in episode.settings.items():
            settings.setdefault(key, {}).setdefault(canonical(value), value)
    solution = plan.solution
    numbers = [each.episode for each in plan.episodes if each.episode is not None]
    return BatchRequest(
        task=plan.task,
        robots=plan.robots,
        environments=plan.environments,
        native=solution.native,
        example=solution.example,
        hold=solution.hold,
        words=solution.words,
        source=solution.source,
        seeds=seeds,
        repeats=1 + max(each.repeat or 0 for each in plan.episodes),
        episodes=list(dict.fromkeys(numbers)) or None,
        settings={key: list(values.values()) for key, values in settings.items()},
        method=plan.method,
        limits=plan.limits,
        timeout_s=plan.timeout_s,
        record=plan.record,
        policy=plan.policy,
        secret=plan.secret,
        device=plan.device,
    )


def shown(seeds: Sequence[int]) -> str:
    """Return seeds in words: as a range where they are one."""
    ordered = sorted(seeds)
    is_range = len(ordered) > 2 and ordered == list(range(ordered[0], ordered[-1] + 1))
    return f"{ordered[0]}..{ordered[-1]}" if is_range else ", ".join(map(str, ordered))
