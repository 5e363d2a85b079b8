"""podman as an ordinary user has it: with further users of their own (subuid(5)), and without control groups."""

import os
import shutil
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tests.engines import CONTAINERS_CONF
from tests.plugins.containers import base_image
from tests.submission.ordinary import SPARE_USER, ordinarily

NAME = "ordinary"
LINES = {
    "passwd": f"{NAME}:x:{SPARE_USER}:{SPARE_USER}::/tmp:/bin/sh",
    "group": f"{NAME}:x:{SPARE_USER}:",
    "subuid": f"{NAME}:300000:65536",
    "subgid": f"{NAME}:300000:65536",
}
# The user exists for what is run alone. One process of podman's stays behind, in its namespaces.
SCRIPT = """\
set -e
folder=$1; shift
for name in passwd group subuid subgid; do mount --bind "$folder/$name" "/etc/$name"; done
exec "$@"
"""
BUILD = 'podman build --quiet --tag "$1" "$2" >/dev/null; shift 2; exec "$@"'
STORAGE_CONF = """\
[storage]
driver = "overlay"
graphroot = "{folder}/graph"
runroot = "{folder}/storage"
"""


class Rootless:
    """The variables of a podman of that user, and commands of theirs."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.variables = {
            "CONTAINERS_CONF": str(folder / "containers.conf"),
            "CONTAINERS_STORAGE_CONF": str(folder / "storage.conf"),
            "XDG_RUNTIME_DIR": str(folder / "run"),
            "PATH": f"{os.environ['PATH']}:/usr/sbin",
        }

    def running(self, command: list[str], folder: Path) -> list[str]:
        """Return the command that runs `command` with the base image; `folder`, the test's, is the user's then."""
        built = ["/bin/sh", "-c", BUILD, "sh", base_image.NAME, str(self._folder / "context")]
        alone = ["unshare", "--mount", "sh", "-c", SCRIPT, "sh", str(self._folder)]
        return [*alone, *ordinarily([*built, *command], folder)]


@contextmanager
def rootless(folder: Path) -> Iterator[Rootless]:
    """Yield that podman, with all that it stores in a folder which others can reach."""
    (folder / "run").mkdir(parents=True)
    (folder / "context").mkdir()
    base_image.write_context(folder / "context")
    (folder / "containers.conf").write_text(CONTAINERS_CONF)
    (folder / "storage.conf").write_text(STORAGE_CONF.format(folder=folder))
    for name, line in LINES.items():
        there = Path("/etc", name)
        (folder / name).write_text(f"{there.read_text() if there.exists() else ''}{line}\n")
        there.touch()
    try:
        yield Rootless(folder)
    finally:
        with suppress(OSError, ValueError):
            os.kill(int((folder / "run/libpod/tmp/pause.pid").read_text()), signal.SIGKILL)
        shutil.rmtree(folder)
