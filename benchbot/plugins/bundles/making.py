"""Making a bundle: results, the source that made them, their scores, and what they ran on, in one file."""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import benchbot
from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.evaluation.submission import Submission
from benchbot.plugins.bundles import archive, readme
from benchbot.plugins.bundles.archive import Member
from benchbot.plugins.bundles.command import portable
from benchbot.plugins.bundles.sources import Source
from benchbot.plugins.installer import lockfile
from benchbot.plugins.installer.distributions import normal

VERSION = 1
MANIFEST, README, SCORES = "manifest.json", "README.md", "scores.json"


def make(
    target: Path,
    submissions: Sequence[Submission],
    source: Source,
    *,
    scores: Mapping[str, Any] | None = None,
    command: Sequence[str] | None = None,
    lock: Path | None = None,
    timeout_s: float | None = None,
) -> dict[str, Any]:
    """Write a bundle of results and the source of the solution that made them; return its manifest.

    The same arguments give the same bytes. `command` is what runs in the source's folder, where the one in the results
    does not. `lock` is a project's `benchbot.lock`; `timeout_s` is what the solution was given. Raises BenchbotError
    when the results are not all of one solution and of one set of software, or the source did not make them.
    """
    solution = _one([_provenance(item).get("solution") or {} for item in submissions], "solutions")
    software = _software(submissions)
    ran = {name: solution[name] for name in ("git_revision", "git_dirty") if name in solution}
    results = [_result(number, item) for number, item in enumerate(submissions, 1)]
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
            "command": list(command) if command is not None else portable(solution, source),
            "mode": solution.get("mode", "native"),
            "timeout_s": timeout_s,
            **ran,
        },
        "software": software,
        **({} if lock is None else {"lock": lockfile.NAME}),
        "results": results,
        "scores": summary,
    }
    members.append(Member(README, readme.text(manifest).encode()))
    manifest["files"] = {member.path: _pinned(member) for member in members}
    schema.check(manifest, "bundle", target)
    archive.write(target, [*members, Member(MANIFEST, _json(manifest))])
    return manifest


def _provenance(item: Submission) -> dict[str, Any]:
    provenance: dict[str, Any] | None = item.document.get("provenance")
    if provenance is None:
        raise BenchbotError(
            f"{item.source} does not say what made it.",
            "It has no provenance: it is of BenchBot v2, or of another program.",
            "Run the solution with this BenchBot, and bundle the new result.",
        )
    return provenance


def _software(submissions: Sequence[Submission]) -> dict[str, Any]:
    """Return what all results together ran on; raises BenchbotError where two of them ran on different versions."""
    found: dict[str, dict[str, Any]] = {"plugins": {}, "assets": {}}
    for submission in submissions:
        for kind, known in found.items():
            for name, pinned in _provenance(submission).get(kind, {}).items():
                if known.setdefault(name, pinned) != pinned:
                    raise BenchbotError(
                        "The results did not run on the same software.",
                        f"{submission.source} ran on another version of {name} than one before it.",
                        "Make a bundle of each set, or run them again.",
                    )
    machine = _provenance(submissions[0]).get("machine")
    used = {kind: dict(sorted(known.items())) for kind, known in found.items() if known or kind == "plugins"}
    return {**used, **({"machine": machine} if machine else {})}


def _require_agreement(lock: Path, software: Mapping[str, Any]) -> None:
    """Raise BenchbotError for a lock of other versions than the results ran on."""
    locked = {one.name: one.version for one in lockfile.read(lock)}
    for name, used in software["plugins"].items():
        if locked.get(normal(name), used["version"]) != used["version"]:
            raise BenchbotError(
                f"{lock} is not what the results ran on.",
                f"It locks {name} {locked[normal(name)]}, and the results are of {used['version']}.",
                "Lock what is installed (benchbot plugins lock), or run the solution again.",
            )


def _one(values: Sequence[dict[str, Any]], what: str) -> dict[str, Any]:
    if any(value != values[0] for value in values):
        raise BenchbotError(
            f"The results are of different {what}.",
            "Their commands, the files that those name, or their revisions differ.",
            "Make a bundle of each: benchbot bundle RESULT… takes results of one solution.",
        )
    return values[0]


def _result(number: int, item: Submission) -> dict[str, Any]:
    provenance = _provenance(item)
    flaw = item.flaw()
    if flaw is not None:
        raise BenchbotError(f"{item.source} cannot be bundled.", flaw, "Bundle results that benchbot submit has kept.")
    name = re.sub(r"[^A-Za-z0-9]+", "-", f"{item.environment} seed {provenance['selection']['seed']}").strip("-")
    return {
        "file": f"results/{number:04d}-{name[:100]}.json",
        "selection": provenance["selection"],
        "observation_digest": provenance["observation_digest"],
        "failure": None if item.failure is None else item.failure.value,
    }


def _with_sources(scores: Mapping[str, Any], named: Mapping[str, str]) -> dict[str, Any]:
    """Return scores whose rows name files of the bundle, not of the machine that it was made on."""

    def renamed(item: Mapping[str, Any]) -> dict[str, Any]:
        source = item.get("source")
        known = None if source is None else named.get(source, Path(source).name)
        return {**item, **({"source": known} if "source" in item else {})}

    coverage = {
        key: [renamed(item) for item in value] if key in ("missing", "skipped") else value
        for key, value in scores["coverage"].items()
    }
    return {**scores, "rows": [renamed(row) for row in scores["rows"]], "coverage": coverage}


def _pinned(member: Member) -> dict[str, Any]:
    with member.opened() as content:
        return {"sha256": archive.digest(content), "bytes": member.size_bytes}


def _json(document: Mapping[str, Any]) -> bytes:
    # As results.write_json writes: what was a result file is byte for byte the same in the bundle.
    return (json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()
