"""What is wrong with files, each by itself: as YAML or JSON, and by the schema of what it declares."""

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import KINDS, Catalog
from benchbot.core.declarations.positions import Positions
from benchbot.core.declarations.problems import pointer
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.findings import Problem
from benchbot.plugins.authoring.checks.targets import SUFFIXES, Target

FOLDERS = {**KINDS, "ground_truths": "ground_truth", "evaluation_methods": "evaluation_method"}
COMMON_KEYS = {"name", "description", "type", "version"}
_ALIKE = 0.85
"""How much of a key's letters another has to share, so that it is taken for that key misspelt (difflib's ratio)."""


@dataclass(frozen=True)
class Document:
    """A file that could be read: what it declares, and what is wrong with it."""

    path: Path
    kind: str
    data: dict[str, Any] = field(hash=False)
    positions: Positions = field(hash=False)
    problems: list[Problem] = field(hash=False)


def kind_of(document: dict[str, Any], path: Path) -> str | None:
    """Return what a file declares: by its folder's name, else the schema that knows most of its keys."""
    return _kind_of_folder(path) or _nearest(document)[0]


def _kind_of_folder(path: Path) -> str | None:
    return FOLDERS.get(path.absolute().parent.name)


def _nearest(document: dict[str, Any]) -> tuple[str | None, int]:
    """Return the kind whose schema knows most of a document's keys, and how many these are."""

    def familiar(kind: str) -> int:
        known = set(schema.schema(kind).get("properties", ())) - COMMON_KEYS
        return len(known & set(document))

    best = max(schema.KINDS, key=familiar)
    if familiar(best):
        return best, familiar(best)

    def resembling(kind: str) -> int:
        known = sorted(set(schema.schema(kind).get("properties", ())) - COMMON_KEYS)
        return sum(bool(get_close_matches(str(key), known, n=1, cutoff=_ALIKE)) for key in document)

    best = max(schema.KINDS, key=resembling)
    return (best, resembling(best)) if resembling(best) else (None, 0)


def examine(target: Target, kind: str | None, catalog: Catalog) -> Document | Problem | None:
    """Return what is in a file, why it cannot be read, or None for one that nobody named and that declares nothing."""
    path = target.path
    if target.named and path.suffix not in (*SUFFIXES, "") and path.is_file():
        return Problem(path, None, "", f"a {path.suffix} file declares nothing: name one of {', '.join(SUFFIXES)}")
    if not path.exists():
        beside = sorted(child.name for child in path.parent.iterdir()) if path.parent.is_dir() else []
        return Problem(path, None, "", f"there is no such file.{did_you_mean(path.name, beside)}")
    if not path.is_file():
        return Problem(path, None, "", "it is not a file")
    try:
        data = schema.read(path)
    except BenchbotError as error:
        surely = target.named or target.kind or kind or _kind_of_folder(path)
        return _unreadable(path, error) if surely or "expected a mapping" not in error.title else None
    kind = kind or target.kind or (kind_of(data, path) if target.named else _kind_of_any(data, path))
    if kind is None:
        known = f"cannot tell what this file declares; say it with --kind. Known: {', '.join(schema.KINDS)}"
        return Problem(path, None, "", known) if target.named else None
    positions = Positions(path)
    found = [*_repeated(path, positions), *schema.problems(data, kind, path)]
    if kind == "result" and not found:
        found += _problems_of_results(path, data, catalog)
    return Document(path, kind, data, positions, found)


def _kind_of_any(document: dict[str, Any], path: Path) -> str | None:
    """Return what a file that nobody named declares: there are layouts, catalogues and configurations, too."""
    kind, familiar = _nearest(document)
    return _kind_of_folder(path) or (kind if familiar * 2 > len(set(document) - COMMON_KEYS) else None)


def _repeated(path: Path, positions: Positions) -> Iterator[Problem]:
    if path.suffix == ".json":
        for key in _repeated_in_json(path):
            yield Problem(path, None, "", f"the key '{key}' is there twice in one object")
        return
    for keys, key, first, line in positions.repeated():
        yield Problem(path, line, pointer(keys), f"the key '{key}' is there twice, and was in line {first}")


def _repeated_in_json(path: Path) -> list[str]:
    found: list[str] = []

    def note(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        counts = Counter(key for key, _ in pairs)
        found.extend(key for key, count in counts.items() if count > 1)
        return {}

    json.loads(path.read_text("utf-8"), object_pairs_hook=note)
    return found


def _unreadable(path: Path, error: BenchbotError) -> Problem:
    line, _, message = error.title.removeprefix(f"{path}:").partition(":")
    if line.isdigit():
        return Problem(path, int(line), "", f"{message.strip()} {error.why}")
    return Problem(path, None, "", f"{error.title.removeprefix(f'{path}:').strip()} {error.why}")


def _problems_of_results(path: Path, document: dict[str, Any], catalog: Catalog) -> Iterator[Problem]:
    """Yield what the task's own results format finds wrong."""
    from benchbot.core.declarations import formats

    name = document["task_details"].get("results_format")
    if name is None or "results" not in document:
        return
    try:
        formats.validate(catalog.get("formats", name), document["results"])
    except BenchbotError as error:
        yield Problem(path, None, "", f"{error.title} {error.why}")
