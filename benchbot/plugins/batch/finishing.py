"""What a batch has to show at the end: results in one place, scores, a report, test cases, an archive."""

import zipfile
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

from benchbot.core import atomic, scores
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.evaluation.score import score_files
from benchbot.plugins.batch.attempts import Attempts
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import Plan
from benchbot.plugins.report import gather, render
from benchbot.plugins.report import write as write_report

_ZIP_TIME = (1980, 1, 1, 0, 0, 0)
"""The earliest that the format knows: the same results make the same archive."""


@dataclass(frozen=True)
class Profile:
    """The files that were made; `scores` is the scores document, None without a method."""

    results: Path
    archive: Path | None = None
    scores: dict[str, Any] | None = None
    scores_path: Path | None = None
    report: Path | None = None
    junit: Path | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON."""
        named = {
            "results": self.results,
            "zip": self.archive,
            "scores": self.scores_path,
            "report": self.report,
            "junit": self.junit,
        }
        return {name: str(path) for name, path in named.items() if path is not None}


def finish(folder: Folder, plan: Plan, catalog: Catalog, *, archive: bool = False) -> Profile:
    """Gather the results that there are, score them if the plan says how, and write what people read.

    Raises BenchbotError when nothing can be scored, or something cannot be written.
    """
    found = {
        episode.name: folder.result(episode.name)
        for episode in plan.episodes
        if Attempts(folder.episode(episode.name)).finished() is not None
    }
    gathered = folder.path / "results"
    try:
        for name, path in found.items():
            content, copy = path.read_bytes(), gathered / f"{name}.json"
            if not copy.is_file() or copy.read_bytes() != content:
                atomic.write(copy, content)
        packed = folder.path / "results.zip" if archive else None
        if packed is not None:
            atomic.write(packed, _zipped(found))
    except OSError as error:
        raise BenchbotError(
            f"The results of the batch cannot be gathered in {gathered}.",
            f"{error.strerror}.",
            "Free some disk space, then run the same command again: nothing is computed twice.",
            exit_code=ExitCode.INTERNAL,
        ) from error
    if plan.method is None or not found:
        return Profile(gathered, packed)
    paths = list(found.values())
    evaluation = score_files(paths, catalog=catalog, method=plan.method, required_task=plan.task)
    scores_path, report, junit = (folder.path / name for name in ("scores.json", "report.html", "junit.xml"))
    scores.write(scores_path, evaluation.document)
    material = gather(evaluation, paths, catalog=catalog)
    write_report(report, render(material, "html"))
    write_report(junit, render(material, "xml"))
    return Profile(gathered, packed, evaluation.document, scores_path, report, junit)


def write_v2(folder: Folder, plan: Plan, profile: Profile, prefix: str) -> list[Path]:
    """Write what BenchBot v2 leaves in the working folder: PREFIX_0.json …, PREFIX_scores.json and PREFIX.zip."""
    written = []
    for number, episode in enumerate(plan.episodes):
        result = folder.result(episode.name)
        if result.is_file():
            written.append(Path(f"{prefix}_{number}.json"))
            atomic.write(written[-1], result.read_bytes())
    for path, name in ((profile.scores_path, f"{prefix}_scores.json"), (profile.archive, f"{prefix}.zip")):
        if path is not None:
            written.append(Path(name))
            atomic.write(written[-1], path.read_bytes())
    return written


def _zipped(results: dict[str, Path]) -> bytes:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in sorted(results.items()):
            archive.writestr(zipfile.ZipInfo(f"{name}.json", _ZIP_TIME), path.read_bytes(), zipfile.ZIP_DEFLATED)
    return packed.getvalue()
