"""`benchbot pack`, and `benchbot submit --submission`: a solution's folder as an archive, as in BenchBot v2."""

from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError


def pack(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="The solution's folder, with its Dockerfile.")],
    target: Annotated[
        Path | None,
        typer.Argument(metavar="[ARCHIVE]", help="The file to write. [default: submission.tgz beside the folder]"),
    ] = None,
) -> None:
    """Pack a solution's folder for others to build and run, as BenchBot v2 does; the archive's path goes to stdout.

    What git ignores stays out; secrets and ground truth are refused.
    """
    from benchbot.plugins.bundles import sources, tarball

    if not folder.is_dir():
        raise BenchbotError(
            f"There is no folder {folder}.", "Its files were to be packed.", "Name the folder of your Dockerfile."
        )
    path = target or folder.resolve().parent / tarball.NAME
    console.check_output(path)
    source = sources.collect(folder)
    tarball.write(source, path)
    console.note(f"Packed {len(source.members)} files.")
    if not any(member.path == "Dockerfile" for member in source.members):
        console.note("There is no Dockerfile among them, by which others could run it: see docs/containers.md")
    console.data(str(path))
