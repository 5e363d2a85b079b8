"""`benchbot check`: the problems of declarations and documents, with file and line."""

from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.core.errors import BenchbotError, ExitCode, did_you_mean

MOST_SHOWN = 3


def check(
    paths: Annotated[
        list[str],
        typer.Argument(metavar="PATH", help="Files, folders, projects of plug-ins, or names of installed plug-ins."),
    ],
    kind: Annotated[
        str | None,
        typer.Option(metavar="KIND", help="What the files are; by default told from the folder's name or the keys."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Say what is wrong with declarations (YAML) and documents (JSON), line by line.

    Warnings are about names that nothing here has, which may be right on another machine. Exits with 2 when
    something is wrong, warnings aside.
    """
    from benchbot.core.declarations import schema
    from benchbot.plugins.authoring.checks import check_all

    if kind is not None and kind not in schema.KINDS:
        raise BenchbotError(
            f"'{kind}' is not a kind of file.",
            f"Known: {', '.join(schema.KINDS)}.{did_you_mean(kind, list(schema.KINDS))}",
            "Name one of these with --kind.",
        )
    report = check_all(paths, kind)
    if as_json:
        console.data_json(
            [
                {
                    "path": str(problem.path),
                    "line": problem.line,
                    "pointer": problem.pointer,
                    "level": "warning" if problem.warning else "error",
                    "message": problem.message,
                }
                for problem in report.problems
            ]
        )
    elif report.problems:
        console.data(*map(str, report.problems))
    if report.left_out:
        shown = ", ".join(str(path) for path in report.left_out[:MOST_SHOWN])
        more = f" and {len(report.left_out) - MOST_SHOWN} more" if len(report.left_out) > MOST_SHOWN else ""
        console.note(f"Left out, since they declare nothing that BenchBot knows: {shown}{more}.")
    wrong = sum(not problem.warning for problem in report.problems)
    counts = ((wrong, "problem"), (len(report.problems) - wrong, "warning"))
    verdict = ", ".join(_count(count, noun) for count, noun in counts if count) or "nothing is wrong"
    console.note(f"{_count(report.files, 'file')} checked: {verdict}.")
    if wrong:
        raise typer.Exit(ExitCode.USAGE)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
