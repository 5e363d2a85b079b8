"""Whether a solution would find the client that BenchBot v2 published, which finds no run without being led to it."""

import importlib.util
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

from benchbot.cli.kit.preflight import Intent
from benchbot.plugin import Catalog, Finding, Level
from benchbot.submission.modes import NATIVE, SolutionSpec

NAME = "benchbot_api"
TIMEOUT_S = 30.0
_ASK = f"import importlib.util as u; found = u.find_spec('{NAME}'); print(found.origin if found else '')"
_PYTHON = re.compile(r"python(\d+(\.\d+)*)?t?")


def check(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield a warning for each native solution that would import another `benchbot_api` than BenchBot's own."""
    for submission in intent.submissions:
        origin = _origin(submission.spec) if submission.mode == NATIVE.name else None
        if origin is not None and origin != _own():
            yield Finding(
                Level.WARNING,
                "client",
                f"The solution imports {origin.parent}, which is not BenchBot's own {NAME}.",
                "If it is the client of BenchBot v2, let it find the run and its result: --v2-client",
            )


def _origin(spec: SolutionSpec) -> Path | None:
    """Return the file of the client that a script imports by name; None where there is none, or nobody can say."""
    scripts = [spec.folder / word for word in spec.command[1:2]]
    if not _PYTHON.fullmatch(Path(spec.command[0]).name) or not scripts or not scripts[0].is_file():
        return None
    if NAME not in scripts[0].read_text("utf-8", "replace"):
        return None
    beside = scripts[0].parent / NAME / "__init__.py"
    if beside.is_file():
        return beside.resolve()
    environment = {**os.environ, **spec.variables}
    program = shutil.which(spec.command[0], path=environment.get("PATH"))
    if program is None:
        return None
    try:
        said = subprocess.run(
            [program, "-c", _ASK],
            env=environment,
            cwd=scripts[0].parent,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        ).stdout.strip()
    except (OSError, subprocess.TimeoutExpired):
        return None
    return Path(said).resolve() if said else None


def _own() -> Path | None:
    found = importlib.util.find_spec(NAME)
    return None if found is None or found.origin is None else Path(found.origin).resolve()
