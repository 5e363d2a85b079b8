"""Submissions as files: a team's archive is made here, and checked by the organiser before it counts.

It is an archive of the one form that bundles have (benchbot.plugins.bundles.archive), which excludes bombs, links and
paths that lead elsewhere: `submission.json` (how the solution runs) and `solution/`, or a whole bundle.
"""

import hashlib
import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import archive, bundle_file, solution_source
from benchbot.plugins.challenge.document import Challenge, Phase

ABOUT = "submission.json"
MOST_ABOUT_BYTES = 2**16
SANDBOX, CONTAINER = "sandbox", "container"


@dataclass(frozen=True)
class Solution:
    """How a submission runs: its words (of a container: what its image is given besides), and what holds it."""

    command: tuple[str, ...]
    mode: str


def pack(source: Path, command: str | None, target: Path) -> Solution:
    """Write the archive of a folder: a container if it has a Dockerfile and no command is given, else for a sandbox.

    Raises BenchbotError for a folder without either, and for what must not be given away.
    """
    collected = solution_source.collect(source)
    if command is None and not any(member.path == "Dockerfile" for member in collected.members):
        raise BenchbotError(
            f"It is not known what runs the solution in {source}.",
            "No command was given, and there is no Dockerfile.",
            "Add what runs it in that folder: --command 'python solution.py'",
        )
    solution = Solution(tuple(shlex.split(command or "")), CONTAINER if command is None else SANDBOX)
    about = {"version": 1, "command": list(solution.command), "mode": solution.mode}
    members = [archive.Member(f"solution/{item.path}", item.content, item.executable) for item in collected.members]
    archive.write(target, [*members, archive.Member(ABOUT, json.dumps(about, sort_keys=True).encode())])
    return solution


def check(path: Path, challenge: Challenge, phase: Phase) -> Solution:
    """Return how an uploaded archive runs; raises BenchbotError for one that is not sound, or not admitted.

    Nothing of it is run, or written anywhere.
    """
    solution = _examined(path)
    if solution.mode not in phase.modes:
        raise BenchbotError(
            f"A solution in a {solution.mode} is not admitted to {phase.title}.",
            f"Admitted: {', '.join(phase.modes)}.",
            "Hand it in with a command (a sandbox) or with a Dockerfile and no command (a container).",
        )
    return solution


def unpack(path: Path, folder: Path) -> Solution:
    """Write a checked archive's solution into a new folder, and return how it runs."""
    solution = _examined(path)
    folder.mkdir(parents=True)
    with archive.opened(path) as found:
        found.extract("solution", folder)
    return solution


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _examined(path: Path) -> Solution:
    with archive.opened(path) as found:
        about = found.members.get(ABOUT)
        has_files = any(name.startswith("solution/") for name in found.members)
        if about is not None and about.size_bytes <= MOST_ABOUT_BYTES and has_files:
            return _solution(path, about.read())
    with bundle_file.opened(path) as bundle:
        ran = bundle.manifest["solution"]
        mode = CONTAINER if ran["mode"] == solution_source.CONTAINER else SANDBOX
        return Solution(tuple(ran["command"]), mode)


def _solution(path: Path, content: bytes) -> Solution:
    try:
        about: Any = json.loads(content)
        command, mode = about["command"], about["mode"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise archive.damaged(path, f"{ABOUT} does not say how the solution runs.") from error
    if mode not in (SANDBOX, CONTAINER) or not _is_words(command) or (mode == SANDBOX and not command):
        raise archive.damaged(path, f"{ABOUT} does not say how the solution runs.")
    return Solution(tuple(command), mode)


def _is_words(command: Any) -> bool:
    return isinstance(command, Sequence) and all(isinstance(word, str) and "\0" not in word for word in command)
