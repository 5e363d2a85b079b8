"""Collecting what is to be scored: results read, filtered by task and environment, and checked."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from benchbot.core import overrides
from benchbot.core.declarations import formats
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.evaluation import inputs
from benchbot.evaluation.coverage import Coverage
from benchbot.evaluation.duplicates import distinct
from benchbot.evaluation.inputs import Other, Submission, Unreadable

_SHOWN = 5


def collect(
    paths: Sequence[Path],
    catalog: Catalog,
    required_task: str | None,
    required_envs: Sequence[str] | None,
    coverage: Coverage,
) -> list[Submission]:
    """Return the submissions that count, all of one task and one for each episode, those of failed ones included.

    Notes the others in `coverage`, and required environments without any result. Raises BenchbotError for an unknown
    required task or environment, for results of several tasks, and when none counts.
    """
    if required_task is not None:
        catalog.get("tasks", required_task)
    for environment in required_envs or ():
        catalog.environments(environment)
    wanted: list[Submission] = []
    for item in inputs.read(paths):
        if isinstance(item, Unreadable):
            coverage.unreadable(item.source, item.error, counts=required_envs is None)
        elif isinstance(item, Other):
            coverage.skip(item.source, item.why)
        elif required_task is not None and item.task != required_task:
            coverage.skip(item.source, f"It is of the task '{item.task}'.")
        elif required_envs is not None and item.environment not in required_envs:
            coverage.skip(item.source, f"It is of the environment '{item.environment}'.")
        else:
            wanted.append(item)
    if not wanted:
        raise _nothing(coverage)
    _require_one_task(wanted)
    found = distinct(wanted, coverage)
    coverage.absent(required_envs or (), wanted)
    _warn_of_settings(found, coverage)
    return found


def has_valid_results(submission: Submission, catalog: Catalog, coverage: Coverage) -> bool:
    """Say whether a submission can be scored: it has results, and they keep to their format. Notes why not."""
    try:
        _require_no_flaw(submission)
        if submission.failure is not None and submission.document.get("results") is None:
            coverage.failed(submission)
            return False
        _validate(submission, catalog)
    except BenchbotError as error:
        coverage.broken(submission, error)
        return False
    return True


def _require_no_flaw(submission: Submission) -> None:
    flaw = submission.flaw()
    if flaw is not None:
        raise BenchbotError(
            f"{submission.source} is not a valid result.",
            flaw,
            "Save a document that is JSON: finite numbers only, and a few levels of lists and mappings.",
        )


def _validate(submission: Submission, catalog: Catalog) -> None:
    if "results" not in submission.document:
        raise BenchbotError(
            f"{submission.source} has no results.",
            "The key 'results' is missing.",
            "Save results that were begun with BenchBot.empty_results().",
        )
    names = {str(scene["name"]) for scene in submission.document["environment_details"]}
    if len(names) > 1:
        raise BenchbotError(
            f"{submission.source} cannot be scored.",
            f"Its scenes are of different environments: {', '.join(sorted(names))}.",
            "Run the task in variants of one environment.",
        )
    if submission.results_format is None:
        raise BenchbotError(
            f"{submission.source} cannot be scored.",
            f"Its task '{submission.task}' has no results_format.",
            "Run a task that has one: benchbot list tasks",
        )
    formats.validate(catalog.get("formats", submission.results_format), submission.document["results"])


def _require_one_task(submissions: Sequence[Submission]) -> None:
    sources: dict[tuple[str, str | None], list[str]] = {}
    for submission in submissions:
        sources.setdefault((submission.task, submission.results_format), []).append(submission.source)
    if len(sources) > 1:
        lines = [
            f"of '{task}' ({results_format}): {_listed(names)}" for (task, results_format), names in sources.items()
        ]
        most, _ = max(sources, key=lambda key: len(sources[key]))
        raise BenchbotError(
            "The results are of different tasks.",
            "\n".join(lines),
            f"Score one task at a time, for example with --required-task {most}",
        )


def _warn_of_settings(submissions: Sequence[Submission], coverage: Coverage) -> None:
    counts = Counter(overrides.label(submission.settings) for submission in submissions)
    if len(counts) > 1:
        said = "; ".join(f"{count} with {settings or 'none'}" for settings, count in sorted(counts.items()))
        coverage.warnings.append(f"The results differ in their settings (--set), and are scored together: {said}")


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more


def _nothing(coverage: Coverage) -> BenchbotError:
    if len(coverage.errors) == 1 == len(coverage.missing) + len(coverage.skipped):
        return coverage.errors[0]
    reasons = [f"{item['source']}: {item['reason']}" for item in [*coverage.missing, *coverage.skipped]]
    return BenchbotError(
        "There is nothing to score.",
        "\n".join(reasons) or "No result was given.",
        "Give at least one result file of the right task and environment.",
    )
