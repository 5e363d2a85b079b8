"""The end of a batch: results in one place, scores, a report, test cases, an archive; and the score until then."""

import json
import time
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

from benchbot.core import atomic, results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.request import digest
from benchbot.evaluation.score import evaluate_files, score_files
from benchbot.plugins.batch import machine
from benchbot.plugins.batch.claims import Heartbeat, HeldClaim, Observer
from benchbot.plugins.batch.costs import Cost, of_batch
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.journal import EventLog
from benchbot.plugins.batch.plan import KEY_DIGITS, Plan
from benchbot.plugins.batch.status import Monitor, Score
from benchbot.plugins.batch.worker_pool import WorkerPool

CLAIM = "conclusion"
_SHOWN = 8
POLL_S = 0.5
LIVE_SCORE_SHARE = 0.05
"""The largest share of the driver's time that is spent on the live score."""
LIVE_SCORE_PERIOD_S = 5.0
_ZIP_TIME = (1980, 1, 1, 0, 0, 0)
"""The earliest time that the format knows: the same results make the same archive."""


@dataclass(frozen=True)
class Products:
    """The files that were made, by what they are: results (a folder), zip, costs, scores, report, junit, comparison."""

    files: dict[str, str]
    scores_of: Mapping[str | None, dict[str, Any]] = field(default_factory=dict)
    """The scores document of each solution; empty when there is no method, or no result."""
    comparison: dict[str, Any] | None = None
    """Of several solutions, that of all pairs."""
    costs: Sequence[Cost] = ()
    problems: Sequence[BenchbotError] = ()
    """Why solutions of several cannot be scored or compared."""

    @property
    def scores(self) -> dict[str, Any] | None:
        """The scores document of a batch of one solution."""
        return self.scores_of.get(None)


def evaluate(folder: Folder, plan: Plan, catalog: Catalog, *, archive: bool = False) -> Products:
    """Gather the results that there are, score them if the plan names a method, and write report and test cases.

    Several solutions are scored each for itself, into `results/NAME` and `scores/NAME`, and compared. Raises
    BenchbotError when nothing can be scored, or something cannot be written.
    """
    hashes = _hashes(folder, plan)
    found = {name: folder.result(name) for name in hashes}
    costs = of_batch(folder, plan)
    files = _gathered(folder, plan, hashes, archive=archive) | {"costs": str(folder.path / "costs.json")}
    results.write_json(Path(files["costs"]), {"costs": [asdict(cost) for cost in costs]})
    scores_of: dict[str | None, dict[str, Any]] = {}
    problems: list[BenchbotError] = []
    for name, alone in plan.each().items() if plan.method is not None else ():
        paths = [found[episode.name] for episode in alone.episodes if episode.name in found]
        place = folder.path if name is None else folder.path / "scores" / name
        try:
            scores_of |= {name: _scored(alone, catalog, paths, place)} if paths else {}
        except BenchbotError as error:
            if name is None or machine.is_disk_full(error):
                raise
            problems.append(error)
        else:
            made = {"scores": "scores.json", "report": "report.html", "junit": "junit.xml"} if paths else {}
            files |= {f"{what} of {name}" if name else what: str(place / file) for what, file in made.items()}
    comparison = None
    if len(scores_of) > 1:
        try:
            comparison = _compared([f"{name}={folder.path / 'scores' / str(name)}" for name in scores_of], catalog)
        except BenchbotError as error:
            problems.append(error)
        else:
            files["comparison"] = str(folder.path / "comparison.json")
            results.write_json(Path(files["comparison"]), comparison)
    return Products(files, scores_of, comparison, costs, problems)


def _gathered(folder: Folder, plan: Plan, hashes: Mapping[str, str], *, archive: bool) -> dict[str, str]:
    """Copy the results with these hashes into one place, by solution; return the names of the files that were made."""
    found = {name: folder.result(name) for name in hashes}
    gathered, packed = folder.path / "results", folder.path / "results.zip"
    places = {episode.name: f"{episode.solution}/" * (episode.solution is not None) for episode in plan.episodes}
    snapshots = {name: one.snapshot.encode() for name, one in plan.all_solutions.items()}
    named = {episode.name: snapshots[episode.solution] for episode in plan.episodes}
    others = []
    try:
        _remove_others(gathered, folder, found)
        for name, path in found.items():
            copy = gathered / f"{places[name]}{name}.json"
            if not copy.is_file() or sha256(copy.read_bytes()).hexdigest() != hashes[name]:
                content = path.read_bytes()
                if named[name] in content:
                    atomic.write(copy, content)
                else:
                    others.append(str(path))
        if others:
            raise _of_another_solution(plan, others)
        if archive:
            atomic.write(packed, _zipped({f"{places[name]}{name}": path for name, path in found.items()}))
    except OSError as error:
        raise BenchbotError(
            f"The results of the batch cannot be gathered in {gathered}.",
            f"{error.strerror}.",
            "Free some disk space, then run the same command again: nothing is computed twice.",
            exit_code=ExitCode.INTERNAL,
        ) from error
    return {"results": str(gathered), **({"zip": str(packed)} if archive else {})}


def _scored(plan: Plan, catalog: Catalog, paths: Sequence[Path], place: Path) -> dict[str, Any]:
    """Score results, and write scores, report and test cases into a folder; return the scores document."""
    from benchbot.plugins.report.episodes import gather
    from benchbot.plugins.report.rendering import render

    evaluation = score_files(paths, catalog=catalog, method=plan.method, required_task=plan.task)
    results.write_scores(place / "scores.json", evaluation.document)
    material = gather(evaluation, paths, catalog=catalog)
    atomic.write_text(place / "report.html", render(material, "html"))
    atomic.write_text(place / "junit.xml", render(material, "xml"))
    return evaluation.document


def _compared(sets: Sequence[str], catalog: Catalog) -> dict[str, Any]:
    """Return the comparison of the solutions whose scores are in folders, written `NAME=FOLDER`."""
    from benchbot.plugins.report import comparison, result_sets

    named = result_sets.read([f"{text}/scores.json" for text in sets], catalog=catalog)
    return comparison.compare(named, result_sets.evaluator_of(named, catalog))


def finalize(folder: Folder, plan: Plan, catalog: Catalog, who: str, *, wait: bool = False) -> None:
    """Evaluate a finished detached batch, once, under a claim like an episode's.

    `conclusion.json` then has the `files` that were made, or the `problem` why there are none. It returns at once when
    another process evaluates just now, unless it is to `wait` for that one. Raises OSError, and BenchbotError when the
    file cannot be written.
    """
    archive = WorkerPool.read(folder).archive
    of = _inputs_hash(folder, plan, archive=archive)
    observer = Observer(folder.claims, plan.policy.stale_s)
    while not _is_finalized(folder, of):
        claim = HeldClaim.take(folder.claims / CLAIM, who)
        if claim is not None:
            try:
                with Heartbeat(claim, plan.policy.stale_s):
                    if not _is_finalized(folder, of):
                        _write_conclusion(folder, plan, catalog, EventLog(folder.events, who), of, archive=archive)
            finally:
                claim.release()
        elif observer.is_stale(CLAIM):
            observer.steal(CLAIM)
        elif wait:
            time.sleep(POLL_S)
        else:
            return


def write_v2(folder: Folder, plan: Plan, products: Products, prefix: str) -> list[Path]:
    """Write the files that BenchBot v2 leaves in the working folder: PREFIX_0.json …, PREFIX_scores.json, PREFIX.zip.

    Raises BenchbotError when they cannot be written.
    """
    copies = [(folder.result(episode.name), f"{prefix}_{place}.json") for place, episode in enumerate(plan.episodes)]
    for kind, ending in (("scores", "_scores.json"), ("zip", ".zip")):
        if kind in products.files:
            copies.append((Path(products.files[kind]), f"{prefix}{ending}"))
    copies = [(path, name) for path, name in copies if path.is_file()]
    try:
        for path, name in copies:
            atomic.write(Path(name), path.read_bytes())
    except OSError as error:
        raise BenchbotError(
            f"The results cannot be written as {prefix}_0.json and so on.",
            f"{error.strerror}.",
            f"They are safe in {folder.path}; choose another --prefix.",
            exit_code=ExitCode.INTERNAL,
        ) from error
    return [Path(name) for _, name in copies]


class LiveScore:
    """Scores the results of a batch that runs, again when there are more, for a small share of the time only.

    `each` scores several solutions, too, each for itself.
    """

    def __init__(self, folder: Folder, method: str | None, catalog: Catalog, *, each: bool = False) -> None:
        self._folder = folder
        self._method = method
        self._catalog = catalog
        self._next_s = 0.0
        self._count = 0
        self._each = each
        self.value: Score | None = None
        self.by_solution: Mapping[str | None, Score] = {}
        """The score of each solution that has one; of a batch of one solution, by None."""
        self.by_episode: Mapping[str, float] = {}
        """The score of each result that has one, by the name of its episode."""

    def update(self, monitor: Monitor) -> Score | None:
        """Return the score of the results, or of those that there were when there was last time for it.

        Several solutions have none together.
        """
        began_s = time.monotonic()
        count = len(monitor.finished)
        several = bool(monitor.plan.solutions)
        if self._method is None or (several and not self._each) or count == self._count or began_s < self._next_s:
            return self.value
        self._count = count
        by_solution: dict[str | None, Score] = {}
        by_episode: dict[str, float] = {}
        for name, alone in monitor.plan.each().items():
            paths = [self._folder.result(each.name) for each in alone.episodes if each.key in monitor.finished]
            with suppress(BenchbotError):  # nothing to score yet; the reason is told at the end
                document = evaluate_files(paths, catalog=self._catalog, method=self._method)
                found = headline(document, len(paths))
                by_solution |= {name: found} if found is not None else {}
                by_episode |= episode_scores(document)
        self.value = by_solution.get(None, self.value if by_episode and not several else None)
        self.by_solution, self.by_episode = by_solution, by_episode
        ended_s = time.monotonic()
        self._next_s = ended_s + max(LIVE_SCORE_PERIOD_S, (ended_s - began_s) / LIVE_SCORE_SHARE)
        return self.value


def headline(document: Mapping[str, Any], results: int) -> Score | None:
    """Return the main score of a scores document, which is of so many results; None when it has none."""
    name = document["method"]["headline"]
    interval = document.get("intervals", {}).get(name) or {}
    value = document["scores"].get(name)
    return None if value is None else Score(name, value, results, interval.get("low"), interval.get("high"))


def episode_scores(document: Mapping[str, Any]) -> dict[str, float]:
    """Return the main score of each result of a batch in a scores document, by the name of its episode."""
    name = document["method"]["headline"]
    rows = ((row.get("source"), row["scores"].get(name)) for row in document["rows"])
    return {Path(source).parent.name: value for source, value in rows if source is not None and value is not None}


def _of_another_solution(plan: Plan, paths: Sequence[str]) -> BenchbotError:
    return BenchbotError(
        f"The batch holds results of another solution than {', '.join(each[:KEY_DIGITS] for each in plan.snapshots)}: "
        f"{len(paths)}.",
        "They do not name the snapshot that the batch runs:\n" + "\n".join(paths[:_SHOWN]),
        "Move them away; the same command then computes these episodes.",
        exit_code=ExitCode.INTERNAL,
    )


def _remove_others(gathered: Path, folder: Folder, found: Mapping[str, Path]) -> None:
    """Remove the copies of results that are of the plan no more; they themselves stay."""
    for copy in gathered.rglob("*.json"):
        original = folder.result(copy.stem)
        if copy.stem not in found and original.is_file() and original.read_bytes() == copy.read_bytes():
            copy.unlink()


def _write_conclusion(
    folder: Folder, plan: Plan, catalog: Catalog, events: EventLog, of: str, *, archive: bool
) -> None:
    events.tell("evaluating")
    try:
        products = evaluate(folder, plan, catalog, archive=archive)
        said: dict[str, object] = {"files": products.files}
        if products.problems:
            said["problem"] = " ".join(f"{error.title} {error.why}" for error in products.problems)
    except BenchbotError as error:
        if machine.is_disk_full(error):
            raise
        said = {"problem": f"{error.title} {error.why}"}
    results.write_json(folder.conclusion, {"of": of, **said})
    events.tell("evaluated", **said)


def _zipped(files: Mapping[str, Path]) -> bytes:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in sorted(files.items()):
            archive.writestr(zipfile.ZipInfo(f"{name}.json", _ZIP_TIME), path.read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def _inputs_hash(folder: Folder, plan: Plan, *, archive: bool) -> str:
    """Return a hash of all that an evaluation depends on: it is made again when episodes were computed once more."""
    return digest([plan.hash, plan.method, archive, _hashes(folder, plan)])


def _hashes(folder: Folder, plan: Plan) -> dict[str, str]:
    """Return the hash of each result, by the name of its episode."""
    found = ((episode.name, folder.finished(episode)) for episode in plan.episodes)
    return {name: finished.sha256 for name, finished in found if finished is not None}


def _is_finalized(folder: Folder, of: str) -> bool:
    try:
        return bool(json.loads(folder.conclusion.read_bytes())["of"] == of)
    except (OSError, ValueError, TypeError, KeyError):
        return False
