"""Collecting the results to score: read, filtered by task and environment, one for each episode, and checked."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchbot.core import overrides
from benchbot.core.budget import Spent, overrun
from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation import batch_folder, result_files
from benchbot.evaluation.batch_folder import PlannedResult
from benchbot.evaluation.coverage import Coverage
from benchbot.evaluation.result_document import ResultDocument, listed
from benchbot.evaluation.result_files import OtherFile, Unreadable


def collect(
    paths: Sequence[Path],
    catalog: Catalog,
    required_task: str | None,
    required_envs: Sequence[str] | None,
    coverage: Coverage,
) -> list[ResultDocument]:
    """Return the results that count, all of one task and one for each episode, those of failed ones included.

    Notes the others in `coverage`, and required environments without any result. Raises BenchbotError for an unknown
    required task or environment, for results of several tasks, and when none counts.
    """
    if required_task is not None:
        catalog.get("tasks", required_task)
    for environment in required_envs or ():
        catalog.environments(environment)
    wanted: list[ResultDocument] = []
    unfinished: list[PlannedResult] = []
    for path in paths:
        found = list(result_files.read([path]))
        for item in found:
            if isinstance(item, Unreadable):
                coverage.unreadable(item.source, item.error, counts=required_envs is None)
            elif isinstance(item, OtherFile):
                coverage.leave_aside(item)
            elif required_task is not None and item.task != required_task:
                coverage.skip(item.source, f"It is of the task '{item.task}'.")
            elif required_envs is not None and item.environment not in required_envs:
                coverage.skip(item.source, f"It is of the environment '{item.environment}'.")
            elif isinstance(item, PlannedResult):
                unfinished.append(item)
                coverage.unfinished(item)
            else:
                wanted.append(item)
        if all(isinstance(item, OtherFile) for item in found):
            coverage.warnings.append(f"There is no result in {path}.")
    if not wanted:
        items = [*coverage.missing, *coverage.skipped]
        fix = "Give at least one result file of the right task and environment."
        raise coverage.nothing("There is nothing to score.", items, fix)
    _require_one_task(wanted)
    kept = distinct(wanted, coverage)
    coverage.absent(required_envs or (), [*wanted, *unfinished])
    _warn_of_settings(kept, coverage)
    _warn_of_restarts(kept, coverage)
    _warn_of_replays(kept, coverage)
    coverage.warnings += batch_folder.added_to(paths)
    return kept


def has_valid_results(result: ResultDocument, catalog: Catalog, coverage: Coverage) -> bool:
    """Say whether a result can be scored: it has results, and they keep to their format. Notes why not."""
    flaw = result.flaw()
    if flaw is None and result.failure is not None and result.document.get("results") is None:
        coverage.failed(result)
        return False
    try:
        _validate(result, flaw, catalog)
    except BenchbotError as error:
        coverage.broken(result, error)
        return False
    return True


def distinct(results: Sequence[ResultDocument], coverage: Coverage) -> list[ResultDocument]:
    """Return one result for each episode, in order; notes what became of the others in `coverage`.

    Equal ones count once. Of those that say that they are of the same episode (all that provenance names as selected:
    robot, environment, seed, …) and differ, none is scored, since none can be told to be the right one. Those that do
    not say their seed, as v2's, cannot be told to be of one episode: they are repeats.
    """
    groups: dict[tuple[Any, ...], list[ResultDocument]] = {}
    for result in results:
        groups.setdefault(_episode(result), []).append(result)
    kept: list[ResultDocument] = []
    for group in groups.values():
        different = _without_copies(group, coverage)
        if len(different) == 1 or different[0].numbers["seed"] is None:
            kept += different
            _warn_of_unknown_seeds(different, coverage)
        else:
            coverage.broken(different[0], _contradiction(different))
    # By identity: documents are large, and do not hash.
    places = {id(result): place for place, result in enumerate(results)}
    return sorted(kept, key=lambda result: places[id(result)])


def _validate(result: ResultDocument, flaw: str | None, catalog: Catalog) -> None:
    if flaw is not None:
        raise BenchbotError(
            f"{result.source} is not a valid result.",
            flaw,
            "Save a document that is JSON: finite numbers only, and a few levels of lists and mappings.",
        )
    if "results" not in result.document:
        raise BenchbotError(
            f"{result.source} has no results.",
            "The key 'results' is missing.",
            "Save results that were begun with BenchBot.empty_results().",
        )
    over = overrun(result.document)
    if over is not None:
        raise BenchbotError(
            f"{result.source} is beyond the limits of its episode.",
            over,
            "Score the result as BenchBot has written it; limits count over all attempts.",
        )
    names = {str(scene["name"]) for scene in result.document["environment_details"]}
    if len(names) > 1:
        raise BenchbotError(
            f"{result.source} cannot be scored.",
            f"Its scenes are of different environments: {', '.join(sorted(names))}.",
            "Run the task in variants of one environment.",
        )
    if result.results_format is None:
        raise BenchbotError(
            f"{result.source} cannot be scored.",
            f"Its task '{result.task}' has no results_format.",
            "Run a task that has one: benchbot list tasks",
        )
    formats.validate(catalog.get("formats", result.results_format), result.document["results"])


def _require_one_task(results: Sequence[ResultDocument]) -> None:
    sources: dict[tuple[str, str | None], list[str]] = {}
    for result in results:
        sources.setdefault((result.task, result.results_format), []).append(result.source)
    if len(sources) > 1:
        lines = [
            f"of '{task}' ({results_format}): {listed(names)}" for (task, results_format), names in sources.items()
        ]
        most, _ = max(sources, key=lambda key: len(sources[key]))
        raise BenchbotError(
            "The results are of different tasks.",
            "\n".join(lines),
            f"Score one task at a time, for example with --required-task {most}",
        )


def _warn_of_settings(results: Sequence[ResultDocument], coverage: Coverage) -> None:
    counts = Counter(overrides.label(result.settings) for result in results)
    if len(counts) > 1:
        said = "; ".join(f"{count} with {settings or 'none'}" for settings, count in sorted(counts.items()))
        coverage.warnings.append(f"The results differ in their settings (--set), and are scored together: {said}")


def _warn_of_restarts(results: Sequence[ResultDocument], coverage: Coverage) -> None:
    """Note what episodes of several attempts have spent: most scores are of the last attempt."""
    told = []
    for about, spent in ((result.about, Spent.of(result.document)) for result in results):
        if spent.restarts:
            counts = f"{spent.restarts + 1} attempts, {spent.steps} steps and {spent.collisions} collisions in all"
            told.append(f"{about}: {counts}")
    if told:
        said = f"in {len(told)} of {len(results)} episodes: {listed(told, '; ')}"
        coverage.warnings.append(f"The robot was put back (restarts) {said}")


def _warn_of_replays(results: Sequence[ResultDocument], coverage: Coverage) -> None:
    """Note results of recordings among those that were driven: their solutions decided over nothing that they saw."""
    replays = [result.about for result in results if result.is_replay]
    if replays and len(replays) < len(results):
        said = f"{len(replays)} of {len(results)} are of recordings: {listed(replays, '; ')}"
        coverage.warnings.append(f"Driven and replayed results are scored together, {said}")


def _episode(result: ResultDocument) -> tuple[Any, ...]:
    return result.environment, *sorted((key, repr(value)) for key, value in result.selection.items())


def _without_copies(group: Sequence[ResultDocument], coverage: Coverage) -> list[ResultDocument]:
    kept: list[ResultDocument] = []
    for result in group:
        equal = next((other for other in kept if other.document == result.document), None)
        if equal is None:
            kept.append(result)
        else:
            coverage.skip(result.source, f"It is the same result as {equal.source}, and counts once.")
    return kept


def _warn_of_unknown_seeds(group: Sequence[ResultDocument], coverage: Coverage) -> None:
    if len(group) > 1:
        sources = ", ".join(result.source for result in group)
        coverage.warnings.append(
            f"{len(group)} results of {group[0].environment} do not say their seed, and count as repeats: {sources}"
        )


def _contradiction(group: Sequence[ResultDocument]) -> BenchbotError:
    sources = " and ".join(result.source for result in group)
    return BenchbotError(
        f"There are {len(group)} different results of one episode.",
        f"{sources} are all of {group[0].about}, and differ: it cannot be told which one counts.",
        "Keep one of them; or, if the episodes were separate, number them in provenance.selection.repeat.",
    )
