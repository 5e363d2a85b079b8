"""Reproducing: the solution of a bundle is run again, and what comes of it is held against what the bundle says."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from benchbot.core import results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.request import Limits
from benchbot.core.selection import Selection
from benchbot.evaluation import evaluate_files
from benchbot.plugins.bundles import comparing, rescoring, selected
from benchbot.plugins.bundles.reading import Bundle
from benchbot.submission import episode
from benchbot.submission.episode import Order, Watcher
from benchbot.submission.modes import private_socket
from benchbot.supervisor.backend import Backend


class Likeness(StrEnum):
    """How alike two results of the same run are."""

    IDENTICAL = "identical"
    WITHIN_TOLERANCE = "within tolerance"
    DIFFERENT = "different"


@dataclass(frozen=True)
class Reproduction:
    """One result of a bundle, made again: `file` is it in the bundle, `path` the new one."""

    file: str
    about: str
    path: Path
    differences: tuple[str, ...]
    scores: Mapping[str, float] | None = None
    """Those of the new result; None when it was not scored."""
    score_differences: tuple[str, ...] = ()
    """Which scores differ by more than the tolerance."""

    @property
    def likeness(self) -> Likeness:
        """Identical to the bit; or different, but with scores within the tolerance; or neither."""
        if not self.differences:
            return Likeness.IDENTICAL
        alike = self.scores is not None and not self.score_differences
        return Likeness.WITHIN_TOLERANCE if alike else Likeness.DIFFERENT


@dataclass(frozen=True)
class Scoring:
    """What came of scoring: the rows of the bundle's results and of the new ones, or why there are none."""

    method: str | None
    false: tuple[str, ...] = ()
    """Which scores in the bundle are not those of the results in it."""
    why_not: str | None = None


def selections(bundle: Bundle, catalog: Catalog) -> list[Selection]:
    """Return what to run again, one for each result, in their order.

    Raises BenchbotError when software is missing, and when a run is not possible here, before anything starts.
    """
    lacking = selected.missing(bundle.manifest["software"])
    if lacking:
        wanted = " ".join(f"{difference.name}=={difference.version}" for difference in lacking)
        raise BenchbotError(
            "Not everything is installed that the bundle ran on.",
            "\n".join(str(difference) for difference in lacking),
            f"Install it: unzip {bundle.path} benchbot.lock && benchbot plugins sync"
            if "lock" in bundle.manifest
            else f"Install it: benchbot install {wanted}",
        )
    found = []
    for row in bundle.manifest["results"]:
        said = row["selection"].get("limits") or {}
        found.append(selected.again({"selection": row["selection"]}, catalog, Limits(**said)))
    return found


def other_software(bundle: Bundle, chosen: Sequence[Selection]) -> list[selected.Difference]:
    """Return how the software here differs from what the results ran on, each difference once."""
    found = {}
    for item, selection in zip(bundle.results, chosen, strict=True):
        for difference in selected.differences(item.document["provenance"], selection):
            found[difference.name] = difference
    return list(found.values())


def run(
    bundle: Bundle, chosen: Sequence[Selection], order: Order, target: Path, watcher: Watcher
) -> Iterator[Reproduction]:
    """Run the solution again for each result, and yield what came of it; new results are written below `target`.

    `order` says how: its mode and limits; its command and folder are those of the solution as unpacked. Raises
    BenchbotError when the simulator or the machine fails: a solution that fails is a result, too.
    """
    order.mode.check()
    for row, before, selection in zip(bundle.manifest["results"], bundle.results, chosen, strict=True):
        document = _run_once(selection, order, watcher)
        path = target / Path(row["file"]).name
        results.write_json(path, document)
        yield Reproduction(row["file"], before.about, path, tuple(comparing.differences(before.document, document)))


def score(
    bundle: Bundle,
    reproductions: Sequence[Reproduction],
    catalog: Catalog,
    ground_truths: Sequence[Path] | None,
    tolerance: float,
) -> tuple[list[Reproduction], Scoring]:
    """Return the reproductions with their scores, and what the scores in the bundle are worth."""
    if bundle.scores is None:
        return list(reproductions), Scoring(None, why_not="The bundle has no scores.")
    method = bundle.scores["method"]["name"]
    with tempfile.TemporaryDirectory(prefix="benchbot-") as folder:
        copies = [Path(folder) / Path(row["file"]).name for row in bundle.manifest["results"]]
        for copy, item in zip(copies, bundle.results, strict=True):
            results.write_json(copy, item.document)
        try:
            before = evaluate_files(copies, catalog=catalog, method=method, ground_truth_paths=ground_truths)
            after = evaluate_files(
                [one.path for one in reproductions], catalog=catalog, method=method, ground_truth_paths=ground_truths
            )
        except BenchbotError as error:
            return list(reproductions), Scoring(method, why_not=f"{error.title} {error.why}")
        false = tuple(rescoring.contradictions(bundle.scores, before))
        said = {str(copy): _row_of(before, copy) for copy in copies}
        found = [
            _scored(one, said[str(copy)], _row_of(after, one.path), tolerance)
            for one, copy in zip(reproductions, copies, strict=True)
        ]
    return found, Scoring(method, false)


def _scored(
    one: Reproduction, said: Mapping[str, float] | None, found: Mapping[str, float] | None, tolerance: float
) -> Reproduction:
    if found is None or said is None:
        # A failed episode has no scores: alike when the other has none, either.
        texts = () if found is said else ("Only one of the two results has scores.",)
        return replace(one, scores=found, score_differences=texts)
    return replace(one, scores=found, score_differences=tuple(rescoring.unequal(said, found, tolerance)))


def _row_of(document: Mapping[str, Any], path: Path) -> Mapping[str, float] | None:
    rows = [row["scores"] for row in document["rows"] if row["source"] == str(path)]
    return rows[0] if rows else None


def _run_once(selection: Selection, order: Order, watcher: Watcher) -> dict[str, Any]:
    with ExitStack() as stack:
        socket = stack.enter_context(private_socket()) if order.mode.needs_socket else None
        backend = stack.enter_context(
            Backend.start(
                selection.request,
                port=None if socket is not None else 0,
                unix_socket=socket,
            )
        )
        ended = episode.run(order, backend.state.connection, backend.died, watcher)
    if ended.problem is not None and ended.problem.exit_code is ExitCode.INTERNAL:
        raise ended.problem
    return ended.document
