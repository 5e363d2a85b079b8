"""A solution as BenchBot v2 packed it for others: `submission.tgz`, to be built and run from its Dockerfile."""

import gzip
import tarfile
import tempfile
from pathlib import Path

from benchbot.bundling.sources import Source
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass

NAME = "submission.tgz"


def write(source: Source, target: Path) -> None:
    """Write a solution's source as v2 did: gzipped, below `./`. The same source gives the same bytes.

    Raises BenchbotError when it cannot be written; `target` is then as it was.
    """
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=target.parent, prefix=f".{target.name}.", delete=False) as file:
            temporary = Path(file.name)
            try:
                with (
                    gzip.GzipFile("", "wb", fileobj=file, mtime=0) as packed,
                    tarfile.open(fileobj=packed, mode="w", format=tarfile.GNU_FORMAT) as tar,
                ):
                    for member in source.members:
                        info = tarfile.TarInfo(f"./{member.path}")
                        info.size = member.size_bytes
                        info.mode = 0o755 if member.executable else 0o644
                        with member.opened() as content:
                            tar.addfile(info, content)
                temporary.chmod(0o644)
                temporary.replace(target)
            finally:
                temporary.unlink(missing_ok=True)
    except OSError as error:
        raise BenchbotError(
            f"Cannot write {target}.",
            error.strerror or str(error),
            "Free some disk space or choose another place, then try again.",
            failure=FailureClass.INFRASTRUCTURE,
            exit_code=ExitCode.INTERNAL,
        ) from error
