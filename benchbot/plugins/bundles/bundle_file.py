"""Writes and reads bundles: results, the solution that made them, their scores and their software, in one file.

Strangers make bundles: everything in one is checked before it is used.
"""

import json
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from packaging.utils import canonicalize_name

import benchbot
from benchbot.core import overrides
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.core.text import markdown, one_line
from benchbot.evaluation.result_document import ResultDocument, parse
from benchbot.evaluation.result_files import SIZE_LIMIT_BYTES
from benchbot.plugins.bundles import archive
from benchbot.plugins.bundles.archive import Archive, Member, damaged
from benchbot.plugins.bundles.snapshot import Snapshot
from benchbot.plugins.bundles.solution_source import CONTAINER, Source, portable_command
from benchbot.plugins.installer import lockfile

VERSION = 1
MANIFEST, README, SCORES = "manifest.json", "README.md", "scores.json"


def make(
    target: Path,
    submissions: Sequence[ResultDocument],
    source: Source,
    *,
    scores: Mapping[str, Any] | None = None,
    command: Sequence[str] | None = None,
    lock: Path | None = None,
    timeout_s: float | None = None,
    snapshot: Snapshot | None = None,
) -> dict[str, Any]:
    """Write a bundle of results and the source of the solution that made them; return its manifest.

    The same arguments give the same bytes. `command` runs in the source's folder and replaces the one in the results.
    `lock` is a project's `benchbot.lock`; `timeout_s` was the solution's time limit; `snapshot` is what the source was
    taken from, if it was. Raises BenchbotError when the
    results are not all of one solution and of one set of software, or the source did not make them.
    """
    solutions = [_provenance(item).get("solution") or {} for item in submissions]
    solution = solutions[0]
    if any(other != solution for other in solutions):
        raise BenchbotError(
            "The results are of different solutions.",
            "Their commands, the files that those name, or their revisions differ.",
            "Make a bundle of each: benchbot bundle RESULT… takes results of one solution.",
        )
    if snapshot is not None:
        solution = snapshot.portable(solution)
    software = _software(submissions)
    ran = {name: solution[name] for name in ("git_revision", "git_dirty") if name in solution}
    results = [_result_row(number, item) for number, item in enumerate(submissions, 1)]
    named = {submission.source: row["file"] for submission, row in zip(submissions, results, strict=True)}
    members = [Member(f"solution/{item.path}", item.content, item.executable) for item in source.members]
    members += [Member(row["file"], _json(item.document)) for row, item in zip(results, submissions, strict=True)]
    if lock is not None:
        _require_agreement(lock, software)
        members.append(Member(lockfile.NAME, lock.read_bytes()))
    summary = None
    if scores is not None:
        scores = _with_sources(scores, named)
        headline = scores["method"]["headline"]
        members.append(Member(SCORES, _json(scores)))
        summary = {
            "file": SCORES,
            "method": scores["method"]["name"],
            "headline": headline,
            "score": scores["scores"].get(headline),
        }
    manifest: dict[str, Any] = {
        "version": VERSION,
        "benchbot": benchbot.__version__,
        "solution": {
            "command": list(command) if command is not None else portable_command(solution, source),
            "mode": solution.get("mode", "native"),
            "timeout_s": timeout_s,
            **ran,
        },
        "software": software,
        **({} if lock is None else {"lock": lockfile.NAME}),
        "results": results,
        "scores": summary,
    }
    members.append(Member(README, _readme(manifest).encode()))
    manifest["files"] = {member.path: _pin(member) for member in members}
    schema.check(manifest, "bundle", target)
    archive.write(target, [*members, Member(MANIFEST, _json(manifest))])
    return manifest


def _provenance(item: ResultDocument) -> Mapping[str, Any]:
    provenance = item.document.get("provenance")
    if provenance is None:
        raise BenchbotError(
            f"{item.source} does not say what made it.",
            "It has no provenance: it is of BenchBot v2, or of another program.",
            "Run the solution with this BenchBot, and bundle the new result.",
        )
    return provenance


def _software(submissions: Sequence[ResultDocument]) -> dict[str, Any]:
    """Return the software of all results together; raises BenchbotError where two of them ran on other versions."""
    found: dict[str, dict[str, Any]] = {"plugins": {}, "assets": {}}
    for item in submissions:
        for kind, known in found.items():
            for name, pinned in _provenance(item).get(kind, {}).items():
                if known.setdefault(name, pinned) != pinned:
                    raise BenchbotError(
                        "The results did not run on the same software.",
                        f"{item.source} ran on another version of {name} than one before it.",
                        "Make a bundle of each set, or run them again.",
                    )
    machine = _provenance(submissions[0]).get("machine")
    used = {kind: dict(sorted(known.items())) for kind, known in found.items() if known or kind == "plugins"}
    return {**used, **({"machine": machine} if machine else {})}


def _require_agreement(lock: Path, software: Mapping[str, Any]) -> None:
    """Raise BenchbotError when a lock names other versions than the results ran on."""
    locked = {one.name: one.version for one in lockfile.read(lock)}
    for name, used in software["plugins"].items():
        if locked.get(canonicalize_name(name), used["version"]) != used["version"]:
            raise BenchbotError(
                f"{lock} is not what the results ran on.",
                f"It locks {name} {locked[canonicalize_name(name)]}, and the results are of {used['version']}.",
                "Lock what is installed (benchbot plugins lock), or run the solution again.",
            )


def _result_row(number: int, item: ResultDocument) -> dict[str, Any]:
    provenance = _provenance(item)
    flaw = item.flaw()
    if flaw is not None:
        raise BenchbotError(f"{item.source} cannot be bundled.", flaw, "Bundle results that benchbot submit has kept.")
    name = re.sub(r"[^A-Za-z0-9]+", "-", f"{item.environment} seed {provenance['selection']['seed']}").strip("-")
    return _row(f"results/{number:04d}-{name[:100]}.json", item)


def _row(file: str, item: ResultDocument) -> dict[str, Any]:
    """Return the entry of a result in the manifest."""
    provenance = item.document.get("provenance") or {}
    return {
        "file": file,
        "selection": provenance.get("selection"),
        "observation_digest": provenance.get("observation_digest"),
        "failure": None if item.failure is None else item.failure.value,
    }


def _with_sources(scores: Mapping[str, Any], named: Mapping[str, str]) -> dict[str, Any]:
    """Return scores whose rows name files in the bundle instead of files on this machine."""

    def renamed(item: Mapping[str, Any]) -> dict[str, Any]:
        source = item.get("source")
        known = None if source is None else named.get(source, Path(source).name)
        return {**item, **({"source": known} if "source" in item else {})}

    coverage = {
        key: [renamed(item) for item in value] if key in ("missing", "skipped") else value
        for key, value in scores["coverage"].items()
    }
    return {**scores, "rows": [renamed(row) for row in scores["rows"]], "coverage": coverage}


def _pin(member: Member) -> dict[str, Any]:
    return {"sha256": member.sha256, "bytes": member.size_bytes}


def _json(document: Mapping[str, Any]) -> bytes:
    # As results.write_json writes it: a result file is byte for byte the same in the bundle.
    return (json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()


def _readme(manifest: Mapping[str, Any]) -> str:
    """Return the README: the solution, its software, the results, and how to make them again."""
    solution, plugins = manifest["solution"], manifest["software"]["plugins"]
    packages = [f"{name}=={used['version']}" for name, used in plugins.items() if used["version"][:1].isdigit()]
    words = shlex.join(solution["command"])
    ran = f"as: {markdown(words)}"
    if solution["mode"] == CONTAINER:
        ran = "in a container of its Dockerfile" + (f", which was given {markdown(words)}" if words else "")
    revision = f", at git revision {markdown(solution['git_revision'])}" if "git_revision" in solution else ""
    changed = " with changes that were not committed" if solution.get("git_dirty") else ""
    rows = []
    for row in manifest["results"]:
        chosen = row["selection"]
        cells = [row["file"], *(chosen[name] for name in ("task", "robot", "environment", "seed"))]
        cells += [overrides.label(chosen.get("settings") or {}) or "-", row["failure"] or "well"]
        rows.append(f"| {' | '.join(markdown(str(cell)) for cell in cells)} |\n")
    scored = ""
    if manifest["scores"] is not None:
        method, headline, score = (manifest["scores"][name] for name in ("method", "headline", "score"))
        value = "none" if score is None else f"{score:.4f}"
        scored = f"\nScored with {markdown(method)}: {markdown(headline)} {value} (`scores.json`).\n"
    return f"""\
# A solution and its results

Made by BenchBot {manifest["benchbot"]}. To make the results again, elsewhere:

```
benchbot install {one_line(" ".join(packages))}
benchbot reproduce BUNDLE.zip
```

The solution is in `solution/`, and ran there {ran}{revision}{changed}.
It is somebody's program: `benchbot reproduce` confines it. What else it needs is yours to install.

| result | task | robot | environment | seed | settings | ended |
|---|---|---|---|---|---|---|
{"".join(rows)}{scored}
`manifest.json` names every file with its SHA-256, every plug-in with version and content.
"""


@dataclass(frozen=True)
class Bundle:
    """A bundle that has been checked: files are as the manifest says, and results and scores are valid."""

    manifest: Mapping[str, Any]
    results: tuple[ResultDocument, ...]
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
        manifest = _document(found, MANIFEST)
        if manifest.get("version") != VERSION:
            raise BenchbotError(
                f"{path} is a bundle of version {manifest.get('version')!r:.20}.",
                f"This BenchBot reads version {VERSION}.",
                "Upgrade BenchBot: pip install --upgrade benchbot",
            )
        _check_schema(found, manifest, "bundle", MANIFEST)
        _check_files(found, manifest["files"])
        results = tuple(_checked_result(found, row) for row in manifest["results"])
        scores = None
        if manifest["scores"] is not None:
            scores = _document(found, manifest["scores"]["file"])
            _check_schema(found, scores, "scores", SCORES)
        yield Bundle(manifest, results, scores, found)


def _check_files(found: Archive, files: Mapping[str, Any]) -> None:
    there = found.members.keys() - {MANIFEST}
    if there != files.keys():
        odd = min(there ^ files.keys())
        raise damaged(found.source, f"{odd!r:.100} is {'not in its manifest' if odd in there else 'missing'}.")
    for path, pinned in files.items():
        if _pin(found.members[path]) != pinned:
            raise damaged(found.source, f"{path!r:.100} is not as its manifest says.")


def _checked_result(found: Archive, row: Mapping[str, Any]) -> ResultDocument:
    path = row["file"]
    item = parse(f"{found.source}:{path}", _content(found, path))
    if _row(path, item) != row:
        raise damaged(found.source, f"{path!r:.100} is not the result that its manifest says.")
    return item


def _check_schema(found: Archive, document: dict[str, Any], kind: str, path: str) -> None:
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
    if path not in found.members:
        raise damaged(found.source, f"It has no {path}.")
    if found.members[path].size_bytes > SIZE_LIMIT_BYTES:
        raise damaged(found.source, f"{path} is larger than {SIZE_LIMIT_BYTES >> 20} MiB.")
    return found.members[path].read()
