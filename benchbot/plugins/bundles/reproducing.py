"""Runs the solution of a bundle again, and compares results and scores with those in the bundle."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
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
from benchbot.plugins.bundles import comparing
from benchbot.plugins.bundles.bundle_file import Bundle
from benchbot.plugins.bundles.comparing import SoftwareDifference
from benchbot.submission import episode
from benchbot.submission.episode import Watcher
from benchbot.submission.modes import SolutionSpec, private_socket
from benchbot.supervisor.backend import Backend


class Likeness(StrEnum):
    """The likeness of two results of the same run."""

    IDENTICAL = "identical"
    WITHIN_TOLERANCE = "within tolerance"
    DIFFERENT = "different"


@dataclass(frozen=True)
class Reproduction:
    """One result of a bundle, made again: `file` is its path in the bundle, `path` that of the new one."""

    file: str
    about: str
    path: Path
    differences: tuple[str, ...]
    scores: Mapping[str, float] | None = None
    """The scores of the new result; None when it was not scored."""
    score_differences: tuple[str, ...] = ()
    """The scores that differ by more than the tolerance, as text."""

    @property
    def likeness(self) -> Likeness:
        """Identical to the bit; else whether the scores are within the tolerance."""
        if not self.differences:
            return Likeness.IDENTICAL
        alike = self.scores is not None and not self.score_differences
        return Likeness.WITHIN_TOLERANCE if alike else Likeness.DIFFERENT


@dataclass(frozen=True)
class Scoring:
    """The outcome of scoring; `why_not` is the reason when nothing was scored."""

    method: str | None
    false: tuple[str, ...] = ()
    """Contradictions between the scores in the bundle and those of its results, as text."""
    why_not: str | None = None


def selections(bundle: Bundle, catalog: Catalog) -> list[Selection]:
    """Return the selection of each result, in their order.

    Raises BenchbotError when software is missing, and when a run is not possible here.
    """
    lacking = comparing.missing_software(bundle.manifest["software"])
    if lacking:
        wanted = " ".join(f"{difference.name}=={difference.version}" for difference in lacking)
        raise BenchbotError(
            "Not everything is installed that the bundle ran on.",
            "\n".join(str(difference) for difference in lacking),
            f"Install it: unzip {bundle.archive.source} benchbot.lock && benchbot plugins sync"
            if "lock" in bundle.manifest
            else f"Install it: benchbot install {wanted}",
        )
    found = []
    for row in bundle.manifest["results"]:
        limits = row["selection"].get("limits") or {}
        found.append(comparing.reselect({"selection": row["selection"]}, catalog, Limits(**limits)))
    return found


def other_software(bundle: Bundle, chosen: Sequence[Selection]) -> list[SoftwareDifference]:
    """Return the differences between the software here and that of the results, one for each name."""
    found = {}
    for item, selection in zip(bundle.results, chosen, strict=True):
        for difference in comparing.software_differences(item.document["provenance"], selection):
            found[difference.name] = difference
    return list(found.values())


def run(
    bundle: Bundle, chosen: Sequence[Selection], spec: SolutionSpec, target: Path, watcher: Watcher
) -> Iterator[Reproduction]:
    """Run the unpacked solution again for each result, as `spec` says; new results are written below `target`.

    Raises BenchbotError when the simulator or the machine fails; a solution that fails is a result, too.
    """
    spec.mode.check()
    for row, before, selection in zip(bundle.manifest["results"], bundle.results, chosen, strict=True):
        document = _run_once(selection, spec, watcher)
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
    """Return the reproductions with their scores, and whether the scores in the bundle are right."""
    if bundle.scores is None:
        return list(reproductions), Scoring(None, why_not="The bundle has no scores.")
    method = bundle.scores["method"]["name"]
    with _copies(bundle) as copies:
        try:
            before, after = (
                _evaluated(paths, bundle.scores, catalog, ground_truths)
                for paths in (copies, [one.path for one in reproductions])
            )
        except BenchbotError as error:
            return list(reproductions), Scoring(method, why_not=f"{error.title} {error.why}")
    found = [
        _scored(one, _scores_of(before, copy), _scores_of(after, one.path), tolerance)
        for one, copy in zip(reproductions, copies, strict=True)
    ]
    return found, Scoring(method, tuple(comparing.score_contradictions(bundle.scores, before)))


def check_scores(bundle: Bundle, catalog: Catalog, ground_truths: Sequence[Path] | None) -> Scoring:
    """Return whether the scores in a bundle are those of its results; nothing is run."""
    if bundle.scores is None:
        return Scoring(None, why_not="The bundle has no scores.")
    method = bundle.scores["method"]["name"]
    with _copies(bundle) as copies:
        try:
            found = _evaluated(copies, bundle.scores, catalog, ground_truths)
        except BenchbotError as error:
            return Scoring(method, why_not=f"{error.title} {error.why}")
    return Scoring(method, tuple(comparing.score_contradictions(bundle.scores, found)))


@contextmanager
def _copies(bundle: Bundle) -> Iterator[list[Path]]:
    """Yield files of the results in a bundle, in their order."""
    with tempfile.TemporaryDirectory(prefix="benchbot-") as folder:
        copies = [Path(folder) / Path(row["file"]).name for row in bundle.manifest["results"]]
        for copy, item in zip(copies, bundle.results, strict=True):
            results.write_json(copy, item.document)
        yield copies


def _evaluated(
    paths: Sequence[Path], stated: Mapping[str, Any], catalog: Catalog, ground_truths: Sequence[Path] | None
) -> dict[str, Any]:
    """Return the scores document of results, by the method of a stated one, and counting what is missing as that."""
    return evaluate_files(
        paths,
        catalog=catalog,
        method=stated["method"]["name"],
        ground_truth_paths=ground_truths,
        missing=stated["coverage"].get("missing_counts", "zero"),
    )


def _scored(
    one: Reproduction, stated: Mapping[str, float] | None, found: Mapping[str, float] | None, tolerance: float
) -> Reproduction:
    if found is None or stated is None:
        # A failed episode has no scores; two of them are alike.
        texts = [] if found is stated else ["Only one of the two results has scores."]
    else:
        texts = comparing.unequal_scores(stated, found, tolerance)
    return replace(one, scores=found, score_differences=tuple(texts))


def _scores_of(document: Mapping[str, Any], path: Path) -> Mapping[str, float] | None:
    rows = [row["scores"] for row in document["rows"] if row["source"] == str(path)]
    return rows[0] if rows else None


def _run_once(selection: Selection, spec: SolutionSpec, watcher: Watcher) -> dict[str, Any]:
    with ExitStack() as stack:
        socket = stack.enter_context(private_socket()) if spec.mode.needs_socket else None
        backend = stack.enter_context(
            Backend.start(
                selection.request,
                owner="benchbot reproduce",
                port=None if socket is not None else 0,
                unix_socket=socket,
            )
        )
        ended = episode.run(spec, backend.state.connection, backend.died, watcher, state=backend.state)
    if ended.problem is not None and ended.problem.exit_code is ExitCode.INTERNAL:
        raise ended.problem
    return ended.document
