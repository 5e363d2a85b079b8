"""A solution as BenchBot v2 packed it for others: `submission.tgz`, to be built and run from its Dockerfile."""

import gzip
import tarfile
from pathlib import Path

from benchbot.core import atomic
from benchbot.plugins.bundles.sources import Source

NAME = "submission.tgz"


def write(source: Source, target: Path) -> None:
    """Write a solution's source as v2 did: gzipped, below `./`. The same source gives the same bytes.

    Raises BenchbotError when it cannot be written; `target` is then as it was.
    """
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
