"""`python -m benchbot_executor_ray.guard SECONDS WORDS…`: runs a command that must not outlive its parent process.

When stdin ends, because it was closed or because whoever held its other end died by whatever means, the command gets
SIGTERM, and after SECONDS everything in its process group SIGKILL. When the guard itself is killed (Ray kills the
children of an actor that it kills), Linux sends the command SIGTERM. The exit code is the command's.
"""

import ctypes
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress

PR_SET_PDEATHSIG = 1


def main(arguments: Sequence[str]) -> int:
    """Run the command; return its exit code, 128 + the signal's number when a signal ended it."""
    patience_s, *command = arguments
    # No thread runs yet, so this may be done between fork and exec.
    process = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        start_new_session=True,
        preexec_fn=_end_with_parent,  # noqa: PLW1509
    )
    threading.Thread(target=_end_with_stdin, args=(process, float(patience_s)), daemon=True).start()
    code = process.wait()
    # What the command left behind in its group goes with it.
    _send(process, signal.SIGKILL)
    return ended(code)


def ended(code: int) -> int:
    """Return an exit code of `subprocess` as a shell would say it."""
    return code if code >= 0 else 128 - code


def _end_with_parent() -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def _end_with_stdin(process: "subprocess.Popen[bytes]", patience_s: float) -> None:
    while os.read(0, 4096):
        pass
    process.terminate()
    try:
        process.wait(patience_s)
    except subprocess.TimeoutExpired:
        _send(process, signal.SIGKILL)


def _send(process: "subprocess.Popen[bytes]", number: signal.Signals) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, number)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
