"""All that is wrong with files: each by itself, and with what they say of each other."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Problem
from benchbot.core.plugin_manager import load
from benchbot.plugins.authoring.checks import documents, project
from benchbot.plugins.authoring.checks.documents import Document
from benchbot.plugins.authoring.checks.names import Names, taken_names, unknown_names
from benchbot.plugins.authoring.checks.places import problems_of_place
from benchbot.plugins.authoring.checks.targets import projects, targets


@dataclass(frozen=True)
class Report:
    """What was found, how many files were looked at, and those in named folders that declare nothing."""

    problems: list[Problem]
    files: int
    left_out: list[Path]


def check_all(words: Sequence[str], kind: str | None = None) -> Report:
    """Check what `words` name (see `targets`), all as a `kind` if one is given; raises BenchbotError for no such thing.

    Problems come in the order of the files, those of one file in the order of its lines.
    """
    catalog = Catalog(load())
    wanted = targets(words)
    found: list[Problem] = []
    readable: list[Document] = []
    left_out: list[Path] = []
    for target in wanted:
        examined = documents.examine(target, kind, catalog)
        if isinstance(examined, Problem):
            found.append(examined)
        elif examined is None:
            left_out.append(target.path)
        else:
            readable.append(examined)
    looked_at = [project.examine(folder, readable) for folder in projects(words)]
    found += [problem for examined in looked_at for problem in examined.problems]
    names = Names(catalog, readable, {text for examined in looked_at for text in examined.texts})
    for document in readable:
        found += document.problems
        if document.kind == "environment" and not document.problems:
            found += problems_of_place(document)
        found += unknown_names(document, names)
    own = {examined.name for examined in looked_at}
    found += taken_names(readable, names, own)
    order = {
        path: number
        for number, path in enumerate([*(p.folder / "pyproject.toml" for p in looked_at), *(t.path for t in wanted)])
    }
    found.sort(key=lambda problem: (order.get(problem.path, 0), problem.line or 0))
    return Report(found, len(wanted) - len(left_out) + len(looked_at), left_out)
