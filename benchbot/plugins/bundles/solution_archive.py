"""`benchbot pack`, and `benchbot submit --submission`: a solution's folder as an archive, as in BenchBot v2."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    from benchbot.plugins.bundles.solution_source import Source

NAME = "submission.tgz"


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
    from benchbot.plugins.bundles import solution_source

    if not folder.is_dir():
        raise BenchbotError(
            f"There is no folder {folder}.", "Its files were to be packed.", "Name the folder of your Dockerfile."
        )
    path = target or folder.resolve().parent / NAME
    console.check_output(path)
    source = solution_source.collect(folder)
    write(source, path)
    console.note(f"Packed {len(source.members)} files.")
    if not any(member.path == "Dockerfile" for member in source.members):
        console.note("There is no Dockerfile among them, by which others could run it: see docs/containers.md")
    console.data(str(path))


def write(source: "Source", target: Path) -> None:
    """Write a solution's source as v2 did: gzipped, below `./`. The same source gives the same bytes.

    Raises BenchbotError when it cannot be written; `target` is then unchanged.
    """
    import gzip
    import tarfile

    from benchbot.core import atomic

    try:
        with (
            atomic.writing(target) as file,
            gzip.GzipFile("", "wb", fileobj=file, mtime=0) as packed,
            tarfile.open(fileobj=packed, mode="w", format=tarfile.GNU_FORMAT) as tar,
        ):
            for member in source.members:
                info = tarfile.TarInfo(f"./{member.path}")
                info.size = member.size_bytes
                info.mode = 0o755 if member.executable else 0o644
                with member.opened() as content:
                    tar.addfile(info, content)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error
