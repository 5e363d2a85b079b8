"""A podman that answers on a socket of our own, for as long as we need it."""

import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.unix_sockets import somebody_listens
from benchbot.submission.solution import Solution

START_TIMEOUT_S = 60.0
POLL_S = 0.02


@contextmanager
def podman(program: str) -> Iterator[Path]:
    """Start `podman system service` of that program, yield its socket when it answers there, and end it on leaving.

    It is a process, not a daemon: where podman is installed, nothing has to be set up. It ends with all that it has
    started, however this process ends. Raises BenchbotError when it does not start.
    """
    with tempfile.TemporaryDirectory(prefix="benchbot-podman-") as folder:
        socket = Path(folder) / "podman.sock"
        command = [program, "system", "service", "--time", "0", f"unix://{socket}"]
        # Under a leader, as a solution is: what an image is built with would outlive the service.
        with Solution(command, Path("/"), os.environ, lambda chunk: None) as service:
            deadline_s = time.monotonic() + START_TIMEOUT_S
            while not somebody_listens(socket):
                if service.wait(POLL_S) is not None or time.monotonic() > deadline_s:
                    raise _does_not_start(service.last_words)
            yield socket


def _does_not_start(said: str) -> BenchbotError:
    return BenchbotError(
        "podman does not start.",
        f"'podman system service' says: {said or 'nothing'}",
        "Try 'podman info'; it says what is missing.",
        exit_code=ExitCode.INTERNAL,
        failure=FailureClass.INFRASTRUCTURE,
    )
