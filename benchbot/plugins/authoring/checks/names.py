"""The names that declarations give each other: is there what they speak of, and is a name free?"""

from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

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
"""Keys of a kind that name something, one or a list, and what: see `Names`."""


class Names:
    """What there is by name: what is installed here, what the checked files declare, what their code speaks of.

    `texts` are the strings in the code of a project: one of them may be the name of its simulator, method or executor.
    """

    def __init__(self, catalog: Catalog, documents: Iterable[Document], texts: Collection[str] = ()) -> None:
        self._catalog = catalog
        self._checked = list(documents)
        self._texts = texts
        self._pools: dict[str, set[str]] = {}

    def known(self, what: str) -> set[str] | None:
        """Return the names of a kind of thing; None where installed plug-ins are at odds over them (see doctor)."""
        try:
            return self._pools[what] if what in self._pools else self._read(what)
        except BenchbotError:
            return None

    def installed(self, kind: str) -> dict[str, Declaration]:
        """Return an installed pool, empty where plug-ins are at odds over it."""
        try:
            return self._catalog.pool(kind)
        except BenchbotError:
            return {}

    def _read(self, what: str) -> set[str]:
        plugins = self._catalog.plugins
        platforms = set(plugins.pool("simulators")) | set(plugins.pool("robot_drivers"))
        if what == "simulators":
            names = platforms.union(self._texts)
        elif what == "types of environments":
            robots = [robot for _, robot in self._declared("robots")]
            named = (robot.get("runs_in") for robot in robots)
            places = {str(place) for listed in named if isinstance(listed, list) for place in listed}
            names = platforms | places.union(self._texts)
        elif what == "methods":
            declared = {str(method.data.get("name")) for method in self._checked if method.kind == "evaluation_method"}
            names = set(plugins.pool("evaluators")) | declared.union(self._texts)
        elif what == "executors":
            names = set(plugins.pool("executors")).union(self._texts)
        elif what == "episodes":
            names = {str(episodes.get("task")) for _, episodes in self._declared("episodes")}
        else:
            names = {name for name, _ in self._declared(what)}
        self._pools[what] = names
        return names

    def _declared(self, kind: str) -> Iterator[tuple[str, dict[str, Any]]]:
        yield from ((name, declaration.data) for name, declaration in self._catalog.pool(kind).items())
        for document in self._checked:
            if document.kind == KINDS[kind] and (name := _name(kind, document)) is not None:
                yield name, document.data


def unknown_names(document: Document, names: Names) -> Iterator[Problem]:
    """Yield a warning for each name that nothing here has: a plug-in that is missing here may bring it."""
    for keys, name, what in _references(document):
        known = names.known(what)
        if known is None or name in known:
            continue
        message = f"'{name}' is none of the {what} that are installed.{_nearest(name, sorted(known))}"
        yield Problem(document.path, document.positions.line(keys), pointer(keys), message, warning=True)


def taken_names(documents: Iterable[Document], names: Names, own: Collection[str | None]) -> Iterator[Problem]:
    """Yield what two files declare alike, and what plug-ins have that are installed, other than `own` distributions."""
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
        if other and other.distribution not in own and not _same_file(other.path, document.path):
            message = f"the name '{name}' is taken by {other.distribution}, which is installed: {other.path}"
            yield Problem(document.path, line, "", message, warning=True)


def _references(document: Document) -> Iterator[tuple[Keys, str, str]]:
    """Yield the keys that lead to a name, the name, and what it is of."""
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


def _nearest(name: str, known: list[str]) -> str:
    longer = next((other for other in known if other.startswith(f"{name}:")), None)
    return f" Did you mean '{longer}'?" if longer else did_you_mean(name, known)


def _name(kind: str, document: Document) -> str | None:
    try:
        return name_of(kind, document.data, document.path)
    except BenchbotError:  # its schema says so
        return None


def _same_file(one: Path, other: Path) -> bool:
    return one.resolve() == other.resolve()
