"""References between declarations, by name: whether a name is known, whether it is free, and schemas that offer it."""

from collections.abc import Collection, Iterable, Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import KINDS, Catalog, Declaration, name_of
from benchbot.core.declarations.problems import pointer
from benchbot.core.errors import BenchbotError, did_you_mean
from benchbot.core.findings import Problem
from benchbot.plugins.authoring.checks.documents import Document

Keys = tuple[str | int, ...]

REFERENCES: dict[str, dict[str, str]] = {
    "task": {"results_format": "formats", "evaluation_method": "methods", "episodes": "episodes"},
    "robot": {"type": "simulators", "runs_in": "types of environments"},
    "environment": {"type": "types of environments", "robots": "robots"},
    "batch": {
        "environments": "environments",
        "task": "tasks",
        "robots": "robots",
        "example": "examples",
        "evaluate_with": "methods",
        "executor": "executors",
    },
    "episodes": {"environment": "environments"},
    "evaluation_method": {"valid_result_formats": "formats", "valid_ground_truth_formats": "formats"},
}
"""The keys of a kind that hold one name or a list of names, and what they name: see `KnownNames`."""


class KnownNames:
    """The known names: of what is installed here, of what the checked files declare, and strings in their code.

    `texts` are the strings in the code of a project: one of them may be the name of its simulator, method or executor.
    """

    def __init__(self, catalog: Catalog, documents: Iterable[Document], texts: Collection[str] = ()) -> None:
        self._catalog = catalog
        self._checked = list(documents)
        self._texts = texts
        self._pools: dict[str, set[str] | None] = {}

    def known(self, what: str) -> set[str] | None:
        """Return the names of a kind of thing; None where installed plug-ins conflict over one (see doctor)."""
        if what not in self._pools:
            try:
                self._pools[what] = self._read(what)
            except BenchbotError:
                self._pools[what] = None
        return self._pools[what]

    def installed(self, kind: str) -> dict[str, Declaration]:
        """Return an installed pool, empty where plug-ins conflict over a name in it."""
        try:
            return self._catalog.pool(kind)
        except BenchbotError:
            return {}

    def _read(self, what: str) -> set[str]:
        plugins = self._catalog.plugins
        platforms = {*plugins.pool("simulators"), *plugins.pool("robot_drivers")}
        match what:
            case "simulators":
                return platforms.union(self._texts)
            case "types of environments":
                named = (robot.get("runs_in") for _, robot in self._declared("robots"))
                places = {str(place) for listed in named if isinstance(listed, list) for place in listed}
                return platforms.union(places, self._texts)
            case "methods":
                methods = (document.data for document in self._checked if document.kind == "evaluation_method")
                return {str(method.get("name")) for method in methods}.union(plugins.pool("evaluators"), self._texts)
            case "executors":
                return {*plugins.pool("executors"), *self._texts}
            case "episodes":
                return {str(episodes.get("task")) for _, episodes in self._declared("episodes")}
            case _:
                return {name for name, _ in self._declared(what)}

    def _declared(self, kind: str) -> Iterator[tuple[str, dict[str, Any]]]:
        yield from ((name, declaration.data) for name, declaration in self._catalog.pool(kind).items())
        for document in self._checked:
            if document.kind == KINDS[kind] and (name := _name(kind, document)) is not None:
                yield name, document.data


def unknown_names(document: Document, names: KnownNames) -> Iterator[Problem]:
    """Yield a warning for each name that is not known: a plug-in that is not installed here may provide it."""
    for keys, name, what in _references(document):
        known = names.known(what)
        if known is None or name in known:
            continue
        message = f"'{name}' is none of the {what} that are installed.{did_you_mean(name, sorted(known))}"
        yield Problem(document.path, document.positions.line(keys), pointer(keys), message, warning=True)


def taken_names(documents: Iterable[Document], names: KnownNames, own: Collection[str | None]) -> Iterator[Problem]:
    """Yield names that two files declare, and those that installed plug-ins other than the `own` ones have taken."""
    first: dict[tuple[str, str], Path] = {}
    kinds = {noun: kind for kind, noun in KINDS.items()}
    for document in documents:
        kind = kinds.get(document.kind, "")
        name = _name(kind, document) if kind else None
        if name is None:
            continue
        line = document.positions.line(["name"])
        before = first.setdefault((kind, name), document.path)
        if before is not document.path:
            message = f"the {document.kind} '{name}' is declared in {before}, too"
            yield Problem(document.path, line, "", message)
        other = names.installed(kind).get(name)
        if other and other.distribution not in own and other.path.resolve() != document.path.resolve():
            message = f"the name '{name}' is taken by {other.distribution}, which is installed: {other.path}"
            yield Problem(document.path, line, "", message, warning=True)


def _references(document: Document) -> Iterator[tuple[Keys, str, str]]:
    """Yield each name in a document: the keys that lead to it, the name, and the kind of thing that it names."""
    for key, what in REFERENCES.get(document.kind, {}).items():
        value = document.data.get(key)
        listed = enumerate(value) if isinstance(value, list) else [(None, value)]
        for index, name in listed:
            keys = (key,) if index is None else (key, index)
            if not isinstance(name, str):
                continue
            if what == "environments":
                place, *variants = name.split(":")
                yield from ((keys, f"{place}:{variant}", what) for variant in variants)
            else:
                yield keys, name, what


def _name(kind: str, document: Document) -> str | None:
    try:
        return name_of(kind, document.data, document.path)
    except BenchbotError:  # the problems of the schema say so
        return None


def schema_with_names(kind: str, names: KnownNames) -> dict[str, Any]:
    """Return a schema that offers installed names where a document names something, so that editors complete them.

    The same documents are valid as before: `benchbot check` warns of names that are not installed.
    """
    document = deepcopy(schema.schema(kind))
    filled = False
    for key, what in REFERENCES.get(kind, {}).items():
        known = sorted(names.known(what) or ())
        if not known:
            continue
        place = document["properties"][key]
        holder, part = (place, "items") if place.get("type") == "array" else (document["properties"], key)
        holder[part] = _offering(holder[part], known)
        filled = True
    if filled:
        document["$id"] += ":here"
        document["$comment"] = "With names of what is installed here; others are allowed, too."
    return document


def _offering(place: dict[str, Any], known: list[str]) -> dict[str, Any]:
    described = {key: place[key] for key in ("description",) if key in place}
    rest = {key: value for key, value in place.items() if key not in described}
    return {**described, "anyOf": [{"enum": known}, rest]}
