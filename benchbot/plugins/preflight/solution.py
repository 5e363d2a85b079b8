"""The program of a solution: there, executable, and with the modules that it imports first; nothing of it is run."""

import json
import os
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.cli.kit.holding import SANDBOX, UNHELD
from benchbot.cli.kit.preflight import Intent, Submission
from benchbot.plugin import Catalog, Finding, Level

PROBE = Path(__file__).with_name("probe.py")
PROBE_TIMEOUT_S = 30.0
LOCAL = "local"
_PYTHON = re.compile(r"python(\d+(\.\d+)*)?t?(\.exe)?")
_SHELLS = frozenset({"sh", "bash", "dash", "zsh", "ksh"})
_WITH_VALUE = frozenset({"-W", "-X", "--check-hash-based-pycs"})
"""The options of Python that take the next word."""


def find(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield what is found of each solution that is a program of this machine."""
    elsewhere = intent.executor not in (None, LOCAL)
    for submission in intent.submissions:
        if submission.mode in (*UNHELD, SANDBOX):
            found = list(_program(submission, elsewhere=elsewhere))
            yield from found or [Finding(Level.OK, "solution", " ".join(submission.spec.command))]


def _program(submission: Submission, *, elsewhere: bool) -> Iterator[Finding]:
    spec = submission.spec
    command = " ".join(spec.command)
    title = f"The solution '{command}' cannot be started."
    environment = {**os.environ, **spec.variables}
    if not spec.folder.is_dir():
        yield Finding(Level.BROKEN, title, f"Its folder {spec.folder} is not there.", "Run the command somewhere else.")
        return
    program = _which(spec.command[0], spec.folder, environment)
    if program is None:
        why = f"{spec.command[0]} is not there, or may not be executed."
        yield Finding(Level.BROKEN, title, why, f"Correct the path, or: chmod +x {spec.command[0]}")
        return
    kind, name = _code(spec.command)
    if kind == "script" and not (spec.folder / name).exists():
        why = f"There is no {spec.folder / name}."
        yield Finding(Level.BROKEN, title, why, f"Correct the path: it is looked for in {spec.folder}.")
    elif name and Path(spec.command[0]).name not in _SHELLS:
        told = _probed(program, kind, name, spec.folder, environment)
        if "problem" in told:
            yield Finding(Level.BROKEN, title, f"{told['problem']}.", "Mend the file, or correct the command.")
        for module in told.get("missing", ()):
            # Nodes of a cluster may have modules that this machine does not have.
            level = Level.WARNING if elsewhere else Level.BROKEN
            why = f"It begins with an import of '{module}', which {program} does not have."
            fix = f"Install it there: {program} -m pip install {module}   Or name the interpreter that has it."
            yield Finding(level, title, why, fix)


def _which(program: str, folder: Path, environment: Mapping[str, str]) -> str | None:
    """Return the program that a command names: on PATH, or where the solution runs."""
    if os.sep not in program:
        return shutil.which(program, path=environment.get("PATH"))
    path = folder / program
    return str(path) if path.is_file() and os.access(path, os.X_OK) else None


def _code(command: Sequence[str]) -> tuple[str, str]:
    """Return `script` or `module`, and the name of what an interpreter is to run; two empty texts: not known."""
    name = Path(command[0]).name
    words = iter(command[1:])
    if _PYTHON.fullmatch(name):
        for word in words:
            if word in _WITH_VALUE:
                next(words, None)
            elif word == "-m":
                return "module", next(words, "")
            elif not word.startswith("-"):
                return "script", word
            elif word == "-" or (word.startswith("-") and not word.startswith("--") and word[-1] in "cm"):
                return "", ""
    elif name in _SHELLS:
        first = next(words, "-")
        return ("script", first) if not first.startswith("-") else ("", "")
    return "", ""


def _probed(program: str, kind: str, name: str, folder: Path, environment: Mapping[str, str]) -> dict[str, Any]:
    """Return what the solution's own interpreter says of its code; nothing when it cannot say anything."""
    try:
        ended = subprocess.run(
            [program, "-c", PROBE.read_text("utf-8"), kind, name],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=PROBE_TIMEOUT_S,
            check=False,
        )
        told: dict[str, Any] = json.loads(ended.stdout)
    except (OSError, ValueError, subprocess.TimeoutExpired):
        return {}
    return told
