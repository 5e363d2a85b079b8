"""The problems of a plug-in's project besides its declarations: whether BenchBot will find them."""

import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.core.errors import did_you_mean
from benchbot.core.findings import Problem
from benchbot.core.plugin_manager import GROUP
from benchbot.plugins.authoring.checks.documents import FOLDERS, Document

_STRING = re.compile(r"""["']([\w.:-]+)["']""")
_HOOKED = frozenset(FOLDERS) - {"evaluation_methods"}


@dataclass(frozen=True)
class Project:
    """A plug-in's pyproject.toml: the name and the problems; and the strings in the code beside it."""

    folder: Path
    name: str | None
    problems: tuple[Problem, ...]
    texts: frozenset[str] = frozenset()


def examine(folder: Path, documents: Iterable[Document]) -> Project:
    """Return the project in a folder, with what is wrong with it."""
    path = folder / "pyproject.toml"
    try:
        text = path.read_text("utf-8")
        written = tomllib.loads(text)
    except (OSError, UnicodeDecodeError) as error:
        return Project(folder, None, (Problem(path, None, "", f"cannot be read: {error}"),))
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"\(at line (\d+)", str(error))
        return Project(folder, None, (Problem(path, int(found[1]) if found else None, "", f"not valid TOML: {error}"),))
    project = written.get("project", {})
    if not isinstance(project, dict):
        return Project(folder, None, (Problem(path, _line(text, "project"), "/project", "it is not a table"),))
    name = project.get("name")
    own = [document for document in documents if document.path.absolute().is_relative_to(folder.absolute())]
    problems = tuple(_problems(folder, path, text, project, own))
    return Project(folder, name if isinstance(name, str) else None, problems, _strings(folder))


def _problems(
    folder: Path, path: Path, text: str, project: dict[str, Any], documents: list[Document]
) -> Iterator[Problem]:
    groups = project.get("entry-points", {})
    points = groups.get(GROUP, {}) if isinstance(groups, dict) else {}
    declaring = sorted({found for document in documents if (found := document.path.parent.name) in _HOOKED})
    if not points:
        if declaring:
            similar = next((group for group in groups if did_you_mean(group, [GROUP])), None)
            line = None if similar is None else _line(text, similar)
            near = f" Did you mean that by '{similar}'?" if similar else ""
            message = f"no entry point of the group '{GROUP}': BenchBot will not find what is declared.{near}"
            yield Problem(path, line, "/project/entry-points", f"{message} Add [project.entry-points.{GROUP}]")
        return
    for name, value in points.items():
        module = str(value).partition(":")[0].strip()
        source = _source(folder, module)
        where = f"/project/entry-points/{GROUP}/{name}"
        if source is None:
            message = f"there is no module '{module}' in {folder / 'src'} or {folder}"
            yield Problem(path, _line(text, module), where, message)
            continue
        code = "".join(file.read_text("utf-8", "replace") for file in sorted(source.parent.rglob("*.py")))
        for kind in declaring:
            inside = any(d.path.parent.name == kind and d.path.is_relative_to(source.parent) for d in documents)
            if inside and f"benchbot_{kind}" not in code:
                message = f"no hook benchbot_{kind} is implemented: BenchBot will not find the folder '{kind}'"
                yield Problem(source, None, "", message)


def _strings(folder: Path) -> frozenset[str]:
    root = folder / "src" if (folder / "src").is_dir() else folder
    return frozenset(
        text for path in root.rglob("*.py") for text in _STRING.findall(path.read_text("utf-8", "replace"))
    )


def _source(folder: Path, module: str) -> Path | None:
    """Return the file of a module in a project with or without a folder `src`."""
    parts = module.split(".")
    for root in (folder / "src", folder):
        for path in (root.joinpath(*parts, "__init__.py"), root.joinpath(*parts[:-1], f"{parts[-1]}.py")):
            if path.is_file():
                return path
    return None


def _line(text: str, word: str) -> int | None:
    return next((number for number, line in enumerate(text.splitlines(), 1) if word in line), None)
