"""Commands on a real terminal, with somebody who answers their question."""

import os
import pty
import select
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

SILENCE_S = 120.0


def asked(
    command: Sequence[str], answer: str, environment: Mapping[str, str], folder: Path | None = None
) -> tuple[int, str]:
    """Run a command that asks `[y/N]`, and answer it once; return its exit status and what it showed."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        command,
        stdin=theirs,
        stdout=subprocess.DEVNULL,
        stderr=theirs,
        cwd=folder,
        env=environment,
        start_new_session=True,
    )
    os.close(theirs)
    shown, answered = "", False
    while select.select([ours], [], [], SILENCE_S)[0]:
        try:
            shown += os.read(ours, 4096).decode()
        except OSError:  # a terminal ends like this on Linux
            break
        if "[y/N]" in shown and not answered:
            answered = True
            os.write(ours, f"{answer}\n".encode())
    os.close(ours)
    return process.wait(SILENCE_S), shown
