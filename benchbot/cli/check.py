"""`benchbot check`: what is wrong with declarations and documents, with file and line."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli import console
from benchbot.cli.options import Json
from benchbot.core.errors import BenchbotError, ExitCode, did_you_mean

if TYPE_CHECKING:
    from benchbot.core.schema import Problem

COMMON_KEYS = {"name", "description", "type", "version"}


def check(
    paths: Annotated[list[Path], typer.Argument(metavar="PATH", help="Files, or folders of them.")],
    kind: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="What the files are; by default told from the folder's name or the keys."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Say what is wrong with declarations (YAML) and documents (JSON), line by line.

    Exits with 2 when something is wrong.
    """
    from benchbot.core import schema

    if kind is not None and kind not in schema.KINDS:
        raise BenchbotError(
            f"'{kind}' is not a kind of file.",
            f"Known: {', '.join(schema.KINDS)}.{did_you_mean(kind, list(schema.KINDS))}",
            "Name one of these with --kind.",
        )
    files = [file for path in paths for file in _files(path)]
    problems = [problem for file in files for problem in _problems(file, kind)]
    if as_json:
        console.data_json([_as_dict(problem) for problem in problems])
    elif problems:
        console.data("\n".join(map(str, problems)))
    console.note(f"{len(files)} file{'s' * (len(files) != 1)} checked: {_verdict(len(problems))}")
    if problems:
        raise typer.Exit(ExitCode.USAGE)


def kind_of(document: dict[str, Any], path: Path) -> str | None:
    """Return what a file declares: by its folder's name, else the schema that knows most of its keys."""
    from benchbot.core import schema
    from benchbot.core.catalog import KINDS

    folders = {**KINDS, "ground_truths": "ground_truth", "evaluation_methods": "evaluation_method"}
    if path.absolute().parent.name in folders:
        return folders[path.absolute().parent.name]

    def familiar(kind: str) -> int:
        known = set(schema.schema(kind).get("properties", ())) - COMMON_KEYS
        return len(known & set(document))

    best = max(schema.KINDS, key=familiar)
    return best if familiar(best) else None


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = sorted(file for file in path.rglob("*") if file.suffix in (".yaml", ".yml", ".json") and file.is_file())
    # What examples and add-ons need beside their declarations is in folders whose names start with a dot.
    found = [file for file in found if not any(part.startswith(".") for part in file.relative_to(path).parts)]
    if not found:
        raise BenchbotError(
            f"There is nothing to check in {path}.",
            "The folder holds no .yaml, .yml or .json file.",
            "Name a file, or a folder that holds some.",
        )
    return found


def _problems(path: Path, kind: str | None) -> Iterator["Problem"]:
    from benchbot.core import schema

    try:
        document = schema.read(path)
    except BenchbotError as error:
        yield _unreadable(path, error)
        return
    kind = kind or kind_of(document, path)
    if kind is None:
        yield schema.Problem(path, None, "", "cannot tell what this file declares; say it with --kind")
        return
    found = schema.problems(document, kind, path)
    yield from found
    if kind == "result" and not found:
        yield from _problems_of_results(path, document)


def _unreadable(path: Path, error: BenchbotError) -> "Problem":
    from benchbot.core.schema import Problem

    line, _, message = error.title.removeprefix(f"{path}:").partition(":")
    if line.isdigit():
        return Problem(path, int(line), "", f"{message.strip()} {error.why}")
    return Problem(path, None, "", f"{error.title.removeprefix(f'{path}:').strip()} {error.why}")


def _problems_of_results(path: Path, document: dict[str, Any]) -> Iterator["Problem"]:
    """Yield what the task's own results format finds wrong."""
    from benchbot.core import formats, schema
    from benchbot.core.catalog import Catalog
    from benchbot.core.plugins import load

    name = document["task_details"].get("results_format")
    if name is None or "results" not in document:
        return
    try:
        formats.validate(Catalog(load()).get("formats", name), document["results"])
    except BenchbotError as error:
        yield schema.Problem(path, None, "", f"{error.title} {error.why}")


def _as_dict(problem: "Problem") -> dict[str, Any]:
    return {
        "path": str(problem.path),
        "line": problem.line,
        "pointer": problem.pointer,
        "message": problem.message,
    }


def _verdict(problems: int) -> str:
    if problems == 0:
        return "nothing is wrong."
    return f"{problems} problem{'s' * (problems != 1)}."
