"""`benchbot submit --submission FOLDER`: nothing is run, a solution is packed for others, as in BenchBot v2."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

Submission = Annotated[
    Path | None,
    typer.Option(
        "--submission",
        "-s",
        metavar="FOLDER",
        help="Run nothing: pack this folder as v2 did, into submission.tgz beside it, or what --args names.",
    ),
]


def pack(folder: Path, target: str | None, others: Mapping[str, object]) -> None:
    """Write a solution's folder as an archive; its path goes to stdout.

    `others` are options, by name, that go together with running a solution. Raises BenchbotError when one is given,
    when there is no such folder, and for what must not be given away.
    """
    from benchbot.plugins.bundles import sources, tarball

    given = [name for name, value in others.items() if value]
    if given:
        raise BenchbotError(
            f"--submission and {given[0]} exclude each other.",
            "With --submission nothing is run: there is no result.",
            "Give one of them. Results and their solution in one file: benchbot bundle",
        )
    if not folder.is_dir():
        raise BenchbotError(
            f"There is no folder {folder}.", "It was named with --submission.", "Name the folder of your Dockerfile."
        )
    path = Path(target) if target else folder.resolve().parent / tarball.NAME
    console.check_output(path)
    source = sources.collect(folder)
    tarball.write(source, path)
    console.note(f"Packed {len(source.members)} files.")
    if not any(member.path == "Dockerfile" for member in source.members):
        console.note("There is no Dockerfile among them, by which others could run it: see docs/containers.md")
    console.data(str(path))
