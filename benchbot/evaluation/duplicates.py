"""Several results of one environment: repeats when their seeds differ, else one result twice, or a contradiction."""

from collections.abc import Sequence
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.evaluation.coverage import Coverage
from benchbot.evaluation.submission import Submission


def distinct(submissions: Sequence[Submission], coverage: Coverage) -> list[Submission]:
    """Return one submission for each episode, in order; notes what became of the others in `coverage`.

    Equal ones count once. Of those that say that they are of the same episode (all that provenance names as selected:
    robot, environment, seed, …) and differ, none is scored, since none can be told to be the right one. Those that do
    not say their seed, as v2's, cannot be told to be of one episode: they are repeats.
    """
    groups: dict[tuple[Any, ...], list[Submission]] = {}
    for submission in submissions:
        groups.setdefault(_episode(submission), []).append(submission)
    kept: list[Submission] = []
    for group in groups.values():
        different = _different(group, coverage)
        if len(different) == 1 or different[0].numbers["seed"] is None:
            kept += different
            _warn_of_unknown_seeds(different, coverage)
        else:
            coverage.broken(different[0], _contradiction(different))
    # By identity: documents are large, and do not hash.
    places = {id(submission): place for place, submission in enumerate(submissions)}
    return sorted(kept, key=lambda submission: places[id(submission)])


def _episode(submission: Submission) -> tuple[Any, ...]:
    return submission.environment, *sorted((key, repr(value)) for key, value in submission.selection.items())


def _different(group: Sequence[Submission], coverage: Coverage) -> list[Submission]:
    kept: list[Submission] = []
    for submission in group:
        equal = next((other for other in kept if other.document == submission.document), None)
        if equal is None:
            kept.append(submission)
        else:
            coverage.skip(submission.source, f"It is the same result as {equal.source}, and counts once.")
    return kept


def _warn_of_unknown_seeds(group: Sequence[Submission], coverage: Coverage) -> None:
    if len(group) > 1:
        sources = ", ".join(submission.source for submission in group)
        coverage.warnings.append(
            f"{len(group)} results of {group[0].environment} do not say their seed, and count as repeats: {sources}"
        )


def _contradiction(group: Sequence[Submission]) -> BenchbotError:
    sources = " and ".join(submission.source for submission in group)
    return BenchbotError(
        f"There are {len(group)} different results of one episode.",
        f"{sources} are all of {group[0].about}, and differ: it cannot be told which one counts.",
        "Keep one of them; or, if the episodes were separate, number them in provenance.selection.repeat.",
    )
