"""Handing in: the archive of a folder, a file, an image, a bundle or an example, and waiting for its score."""

import re
import shlex
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.cli.kit import console
from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.bundles import archive as bundle_archive
from benchbot.plugins.challenge import intake
from benchbot.plugins.challenge.client import Server
from benchbot.plugins.challenge.document import MODES, QUEUED, RUNNING
from benchbot.plugins.containers import engine, transfer

POLL_S = 1.0
IMAGE = re.compile(r"[a-z0-9][a-zA-Z0-9._:@/-]*")
"""The names that an image can have, digests included."""
PATIENCE_S = 300.0
"""So long may a server be away before waiting for it ends."""


@dataclass(frozen=True)
class Admitted:
    """What a phase admits, where that is known before anything is made for it."""

    phase: str = ""
    modes: Sequence[str] = MODES
    most_bytes: int = bundle_archive.MAX_BYTES


@contextmanager
def archive(what: str | None, command: str | None, example: str | None, admitted: Admitted) -> Iterator[Path]:
    """Yield the archive to hand in: the one that was named, or one that is made of what was named."""
    if (what is None) == (example is None):
        raise BenchbotError(
            "It is not clear what to hand in.",
            "Name a folder, a file, an image or a bundle, or an example, and not both.",
            "Such as: benchbot challenge submit URL . --command 'python solution.py'",
        )
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "submission.zip"
        if example is not None:
            found = Catalog(plugin_manager.load()).get("examples", example)
            words = shlex.split(found.data["native_command"])
            files = [found.path.parent / word for word in words if (found.path.parent / word).is_file()]
            intake.pack(files[0] if len(files) == 1 else found.path.parent, shlex.join(words), target)
            yield target
        elif Path(str(what)).suffix == ".zip" and command is None and Path(str(what)).exists():
            yield Path(str(what))
        else:
            pack(str(what), command, target, admitted)
            yield target


def pack(what: str, command: str | None, target: Path, admitted: Admitted = Admitted()) -> None:
    """Write the archive of a folder or file, or of an image of this machine's engine where there is no such file.

    Raises BenchbotError for what is not there, what must not be given away, and an image that is not admitted.
    """
    if Path(what).exists():
        intake.pack(Path(what), command, target)
        return
    if command is not None or not IMAGE.fullmatch(what):
        raise BenchbotError(
            f"There is no {what}.",
            "With --command a folder or a file is handed in."
            if command is not None
            else "It is neither a folder nor a file, and no name of an image.",
            "Name a folder or a file; or an image, and no command: benchbot challenge submit URL docker.io/me/robot:1",
        )
    intake.require_admitted(intake.CONTAINER, admitted.modes, admitted.phase)
    console.note(f"There is no folder or file {what}: the image of that name is saved.")
    with tempfile.TemporaryDirectory() as name, engine.reached() as reached:
        transfer.save(reached, what, Path(name) / "image", admitted.most_bytes)
        intake.pack(Path(name) / "image", None, target)


def wait(server: Server, submission: dict[str, Any]) -> dict[str, Any]:
    """Return a submission once it has ended; a server that is away for less than `PATIENCE_S` is waited for."""
    answered_at = time.monotonic()
    while submission["state"] in (QUEUED, RUNNING):
        time.sleep(POLL_S)
        try:
            submission = server.ask("GET", f"/api/v1/submissions/{submission['id']}")
            answered_at = time.monotonic()
        except BenchbotError as error:
            is_away = error.exit_code == ExitCode.INTERNAL
            if not is_away or time.monotonic() - answered_at > PATIENCE_S:
                raise
    return submission
