"""Runs solutions in sandboxes, as a process of its own: whoever tests may run it as another user.

Reads a JSON list of `{"code", "limits", "weak_limits", "readable", "bubblewrap", "wait_s"}` from stdin and
writes one of how each has ended to stdout.
"""

import json
import os
import socket
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.sandbox import mode
from benchbot.submission.modes import RESULT, ProcessLimits, SolutionSpec, private_socket
from benchbot.wire.run_state import Connection

WAIT_S = 60.0


def run(case: Mapping[str, Any], folder: Path, path: Path) -> dict[str, Any]:
    """Run one solution, with a socket that listens and never answers; return how it ended."""
    if not case.get("bubblewrap", True):
        os.environ["PATH"] = ""
        mode.bubblewrap_problem.cache_clear()
    work, exchange = folder / "work", folder / "exchange"
    work.mkdir(parents=True)
    exchange.mkdir(mode=0o700)
    (work / "solution.py").write_text(case["code"])
    output = bytearray()
    limits = ProcessLimits(**case.get("limits", {}))
    ended: dict[str, Any] = {"status": None, "explained": None}
    options = mode.resolved({"readable": case.get("readable", ()), "weak_limits": case.get("weak_limits", False)})
    connection = Connection("http://127.0.0.1:1", str(path), "token")
    try:
        with (
            mode.prepared(SolutionSpec([sys.executable, "solution.py"], work, limits=limits), options, len) as spec,
            spec.mode.start(spec, connection, exchange, output.extend) as held,
        ):
            ended |= {"mode": spec.mode.name, "weak_limits": spec.weak_limits}
            ended["command_line"] = Path(f"/proc/{held.process}/cmdline").read_text()
            ended["status"] = held.wait(case.get("wait_s", WAIT_S))
            ending_s = time.monotonic()
            explained = held.explain(ended["status"]) if ended["status"] is not None else None
            ended["explained"] = None if explained is None else f"{explained.title} {explained.why} {explained.fix}"
        ended["ending_s"] = time.monotonic() - ending_s
    except BenchbotError as error:
        ended["explained"] = str(error)
    result = exchange / RESULT
    return {
        **ended,
        "output": output.decode("utf-8", "replace"),
        "result": result.read_text()[:100_000] if result.exists() else None,
        "groups": [place for place, _, _ in os.walk("/sys/fs/cgroup") if f"/benchbot-{os.getpid()}-" in place],
    }


def main() -> None:
    """Run what stdin holds."""
    cases = json.load(sys.stdin)
    with tempfile.TemporaryDirectory() as name, private_socket() as path, socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(path))
        path.chmod(0o600)
        listening.listen()
        ended = [run(case, Path(name) / str(number), path) for number, case in enumerate(cases)]
    json.dump(ended, sys.stdout)


if __name__ == "__main__":
    main()
