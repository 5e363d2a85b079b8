"""Reading a bundle: nothing of it is believed before it has been checked, and nothing is unpacked by its own names."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.evaluation import submission
from benchbot.evaluation.inputs import SIZE_LIMIT_BYTES
from benchbot.evaluation.submission import Submission
from benchbot.plugins.bundles import archive
from benchbot.plugins.bundles.archive import Archive, damaged
from benchbot.plugins.bundles.making import MANIFEST, SCORES, VERSION


@dataclass(frozen=True)
class Bundle:
    """A bundle that keeps its promises: files are as the manifest says, results are results, scores are scores."""

    path: Path
    manifest: Mapping[str, Any]
    results: tuple[Submission, ...]
    """In the order of the manifest."""
    scores: Mapping[str, Any] | None
    archive: Archive

    def extract_solution(self, folder: Path) -> None:
        """Write the solution's source into an empty folder."""
        self.archive.extract("solution", folder)


@contextmanager
def opened(path: Path) -> Iterator[Bundle]:
    """Open a bundle; raises BenchbotError for one that is damaged, hostile, or of a version that is not known."""
    with archive.opened(path) as found:
        manifest = _manifest(found)
        _check_files(found, manifest["files"])
        results = tuple(_result(found, row) for row in manifest["results"])
        scores = None if manifest["scores"] is None else _scores(found, manifest["scores"])
        yield Bundle(path, manifest, results, scores, found)


def _manifest(found: Archive) -> dict[str, Any]:
    document = _document(found, MANIFEST)
    version = document.get("version")
    if version != VERSION:
        raise BenchbotError(
            f"{found.source} is a bundle of version {version!r:.20}.",
            f"This BenchBot reads version {VERSION}.",
            "Upgrade BenchBot: pip install --upgrade benchbot",
        )
    _check(document, "bundle", found, MANIFEST)
    return document


def _check_files(found: Archive, files: Mapping[str, Any]) -> None:
    there = set(found.paths) - {MANIFEST}
    if there != set(files):
        odd = min(there ^ set(files))
        raise damaged(found.source, f"{odd!r:.100} is {'not in its manifest' if odd in there else 'missing'}.")
    for path, pinned in files.items():
        with found.opened(path) as content:
            digest = archive.digest(content)
        if (digest, found.size_bytes(path)) != (pinned["sha256"], pinned["bytes"]):
            raise damaged(found.source, f"{path!r:.100} is not as its manifest says.")


def _result(found: Archive, row: Mapping[str, Any]) -> Submission:
    path = row["file"]
    item = submission.parse(f"{found.source}:{path}", _content(found, path))
    provenance = item.document.get("provenance") or {}
    said = {
        "selection": provenance.get("selection"),
        "observation_digest": provenance.get("observation_digest"),
        "failure": None if item.failure is None else item.failure.value,
    }
    if said != {key: row[key] for key in said}:
        raise damaged(found.source, f"{path!r:.100} is not the result that its manifest says.")
    return item


def _scores(found: Archive, summary: Mapping[str, Any]) -> dict[str, Any]:
    document = _document(found, summary["file"])
    _check(document, "scores", found, SCORES)
    return document


def _check(document: dict[str, Any], kind: str, found: Archive, path: str) -> None:
    problems = schema.problems(document, kind, Path(f"{found.source}:{path}"))
    if problems:
        raise damaged(found.source, "\n".join(str(problem) for problem in problems[:5]))


def _document(found: Archive, path: str) -> dict[str, Any]:
    try:
        document = json.loads(_content(found, path))
    except (ValueError, RecursionError) as error:
        raise damaged(found.source, f"{path} is not valid JSON: {error}.") from error
    if not isinstance(document, dict):
        raise damaged(found.source, f"{path} holds no mapping.")
    return document


def _content(found: Archive, path: str) -> bytes:
    if path not in found.paths:
        raise damaged(found.source, f"It has no {path}.")
    if found.size_bytes(path) > SIZE_LIMIT_BYTES:
        raise damaged(found.source, f"{path} is larger than {SIZE_LIMIT_BYTES >> 20} MiB.")
    return found.read(path)
