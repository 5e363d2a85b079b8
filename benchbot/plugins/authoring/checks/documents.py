"""The problems of each file by itself: as YAML or JSON, by the schema of its kind, and by the files beside it."""

import json
import math
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
from benchbot.evaluation import occupancy_map

SUFFIXES = (".yaml", ".yml", ".json")
FOLDERS = {**KINDS, "ground_truths": "ground_truth", "evaluation_methods": "evaluation_method"}
COMMON_KEYS = {"name", "description", "type", "version"}
_SIMILARITY = 0.85
"""How much of a key's letters another has to share to be taken for that key misspelt (difflib's ratio)."""
# Quaternions are normalised when they are read, and those of v2 are rounded; positions in their place are far off.
_NORM_TOLERANCE = 0.5


@dataclass(frozen=True)
class CheckTarget:
    """A file to check. `kind` is set where that is known, `named` where the user named this very file."""

    path: Path
    named: bool = False
    kind: str | None = None


@dataclass(frozen=True)
class Document:
    """A file that could be read: its kind, its content, and what is wrong with it."""

    path: Path
    kind: str
    data: dict[str, Any] = field(hash=False)
    positions: Positions = field(hash=False)
    problems: list[Problem] = field(hash=False)


def kind_of(document: dict[str, Any], path: Path) -> str | None:
    """Return what a file declares: by its folder's name, else the schema that knows most of its keys."""
    return _kind_of_folder(path) or _nearest_kind(document)[0]


def examine(target: CheckTarget, kind: str | None, catalog: Catalog) -> Document | Problem | None:
    """Return the content of a file, why it cannot be read, or None for one that was not named and declares nothing."""
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
    if str(data.get("$schema", "")).startswith("https://json-schema.org/"):
        declared = "a JSON Schema declares nothing: name the format that brings it"
        return Problem(path, None, "", declared) if target.named else None
    kind = kind or target.kind or (kind_of(data, path) if target.named else _kind_of_unnamed(data, path))
    if kind is None:
        known = f"cannot tell what this file declares; say it with --kind. Known: {', '.join(schema.KINDS)}"
        return Problem(path, None, "", known) if target.named else None
    positions = Positions(path)
    found = [*_repeated_keys(path, positions), *schema.problems(data, kind, path)]
    document = Document(path, kind, data, positions, found)
    if not found and kind == "result":
        found += _problems_of_results(document, catalog)
    elif not found and kind == "environment":
        found += _problems_of_environment(document)
    elif not found and kind == "format" and "schema" in data:
        found += _problems_of_format(document)
    return document


def _kind_of_folder(path: Path) -> str | None:
    return FOLDERS.get(path.absolute().parent.name)


def _kind_of_unnamed(document: dict[str, Any], path: Path) -> str | None:
    """Return the kind of a file that was not named: layouts, catalogues and configurations are in folders, too."""
    kind, known = _nearest_kind(document)
    return _kind_of_folder(path) or (kind if known * 2 > len(set(document) - COMMON_KEYS) else None)


def _nearest_kind(document: dict[str, Any]) -> tuple[str | None, int]:
    """Return the kind whose schema knows most of a document's keys, by name or else by similarity, and how many."""
    keys = {kind: set(schema.schema(kind).get("properties", ())) - COMMON_KEYS for kind in schema.KINDS}
    counts = {kind: len(known & set(document)) for kind, known in keys.items()}
    if not any(counts.values()):
        for kind, known in keys.items():
            similar = (get_close_matches(str(key), sorted(known), n=1, cutoff=_SIMILARITY) for key in document)
            counts[kind] = sum(map(bool, similar))
    best = max(counts, key=counts.__getitem__)
    return (best, counts[best]) if counts[best] else (None, 0)


def _repeated_keys(path: Path, positions: Positions) -> Iterator[Problem]:
    if path.suffix != ".json":
        for keys, key, first, line in positions.repeated():
            yield Problem(path, line, pointer(keys), f"the key '{key}' is there twice, and was in line {first}")
        return
    repeated: list[str] = []

    def note(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        counts = Counter(key for key, _ in pairs)
        repeated.extend(key for key, count in counts.items() if count > 1)
        return {}

    json.loads(path.read_text("utf-8"), object_pairs_hook=note)
    yield from (Problem(path, None, "", f"the key '{key}' is there twice in one object") for key in repeated)


def _unreadable(path: Path, error: BenchbotError) -> Problem:
    title = error.title.removeprefix(f"{path}:")
    line, _, message = title.partition(":")
    if line.isdigit():
        return Problem(path, int(line), "", f"{message.strip()} {error.why}")
    return Problem(path, None, "", f"{title.strip()} {error.why}")


def _problems_of_results(document: Document, catalog: Catalog) -> Iterator[Problem]:
    """Yield what the task's own results format finds wrong."""
    from benchbot.core.declarations import formats

    name = document.data["task_details"].get("results_format")
    if name is None or "results" not in document.data:
        return
    try:
        formats.validate(catalog.get("formats", name), document.data["results"])
    except BenchbotError as error:
        yield Problem(document.path, None, "", f"{error.title} {error.why}")


def _problems_of_format(document: Document) -> Iterator[Problem]:
    """Yield what is wrong with the JSON Schema that a format names."""
    from jsonschema import Draft202012Validator, SchemaError

    path = document.path.parent / str(document.data["schema"])
    try:
        Draft202012Validator.check_schema(schema.read(path))
    except BenchbotError as error:
        message = f"{error.title} {error.why}" if path.is_file() else f"there is no file '{path.name}' beside this one"
        yield Problem(document.path, document.positions.line(["schema"]), pointer(["schema"]), message)
    except SchemaError as error:
        message = f"'{path.name}' is no JSON Schema: {error.message}"
        yield Problem(document.path, document.positions.line(["schema"]), pointer(["schema"]), message)


def _problems_of_environment(document: Document) -> Iterator[Problem]:
    """Yield what is wrong with the files that an environment names, and with its poses."""

    def problem(keys: list[str | int], message: str, *, warning: bool) -> Problem:
        return Problem(document.path, document.positions.line(keys), pointer(keys), message, warning)

    for key in ("map_path", "occupancy_map"):
        name = document.data.get(key)
        if name is None or (document.path.parent / name).is_file():
            continue
        # Other simulators name scenes in a store of their own, such as /Game/Maps/house or omniverse://….
        elsewhere = name.startswith("/") or "://" in name
        yield problem([key], f"there is no file '{name}'; it is looked for beside this file", warning=elsewhere)
    trajectory = document.data.get("trajectory_poses") or ()
    poses: list[tuple[list[str | int], list[float]]] = [(["start_pose"], document.data["start_pose"])]
    poses += [(["trajectory_poses", index], pose) for index, pose in enumerate(trajectory)]
    for keys, pose in poses:
        norm = math.hypot(*pose[:4])
        if abs(norm - 1) > _NORM_TOLERANCE:
            message = (
                f"its first four numbers are no unit quaternion (norm {norm:.3g}). "
                "Write [qw, qx, qy, qz, x, y, z]; no rotation is 1, 0, 0, 0"
            )
            yield problem(keys, message, warning=norm > 0)
    named = next((key for key in ("map_path", "occupancy_map") if key in document.data), None)
    if named is None or document.data["type"] != occupancy_map.REAL:
        return
    path = document.path.parent / str(document.data[named])
    if path.is_file():
        try:
            found = occupancy_map.read(path)
        except BenchbotError as error:
            yield problem([named], f"{error.title} {error.why} {error.fix}", warning=False)
            return
        for keys, pose in poses:
            there = found.place(pose[4], pose[5])
            if there != "free":
                yield problem(keys, f"its place is {there} in the map {path.name}", warning=keys != ["start_pose"])
