"""Handing in: the archive of a folder, a file, a bundle or an example, and waiting for its score."""

import shlex
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.plugins.challenge import intake
from benchbot.plugins.challenge.client import Server
from benchbot.plugins.challenge.document import QUEUED, RUNNING

POLL_S = 1.0
PATIENCE_S = 300.0
"""So long may a server be away before waiting for it ends."""


@contextmanager
def archive(what: str | None, command: str | None, example: str | None) -> Iterator[Path]:
    """Yield the archive to hand in: the one that was named, or one that is made of what was named."""
    if (what is None) == (example is None):
        raise BenchbotError(
            "It is not clear what to hand in.",
            "Name a folder, a file or a bundle, or an example, and not both.",
            "Such as: benchbot challenge submit URL . --command 'python solution.py'",
        )
    if what is not None and not Path(what).exists():
        raise BenchbotError(
            f"There is no {what}.",
            "A folder, a file or a bundle is handed in; an image by name is not: whoever scores builds its own.",
            "Name the folder of the image's Dockerfile, or one with a Dockerfile of the line: FROM IMAGE",
        )
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "submission.zip"
        if example is not None:
            found = Catalog(plugin_manager.load()).get("examples", example)
            words = shlex.split(found.data["native_command"])
            files = [found.path.parent / word for word in words if (found.path.parent / word).is_file()]
            intake.pack(files[0] if len(files) == 1 else found.path.parent, shlex.join(words), target)
            yield target
        elif Path(str(what)).suffix == ".zip" and command is None:
            yield Path(str(what))
        else:
            intake.pack(Path(str(what)), command, target)
            yield target


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
