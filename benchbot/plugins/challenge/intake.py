"""Submissions as files: a team's archive is made here, and checked by the organiser before it counts.

It is an archive of the one form that bundles have (benchbot.plugins.bundles.archive), which excludes bombs, links and
paths that lead elsewhere: `submission.json` (how the solution runs) and `solution/`, or a whole bundle. Of a container
`solution/` is what its image is built from, or the image itself (benchbot.plugins.containers.layout).
"""

import hashlib
import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles import archive, bundle_file, solution_source
from benchbot.plugins.challenge.document import Challenge, Phase
from benchbot.plugins.containers import layout

ABOUT = "submission.json"
MOST_ABOUT_BYTES = 2**16
SANDBOX, CONTAINER = "sandbox", "container"


@dataclass(frozen=True)
class Solution:
    """How a submission runs: its words (of a container: what its image is given besides), and what holds it."""

    command: tuple[str, ...]
    mode: str
    image: str | None = None
    """The digest of the image that was handed in, `sha256:…`; None for one that is built, and for a sandbox."""


def pack(source: Path, command: str | None, target: Path) -> Solution:
    """Write the archive of a folder: a container if it has a Dockerfile or is an image, and no command is given.

    Else it is for a sandbox. Raises BenchbotError for a folder without either, and for what must not be given away.
    """
    if command is None and (source / layout.MARKER).is_file():
        return _pack_image(source, target)
    collected = solution_source.collect(source)
    if command is None and not any(member.path == "Dockerfile" for member in collected.members):
        raise BenchbotError(
            f"It is not known what runs the solution in {source}.",
            "No command was given, and there is no Dockerfile.",
            "Add what runs it in that folder: --command 'python solution.py'",
        )
    mode = CONTAINER if command is None else SANDBOX
    members = [archive.Member(f"solution/{item.path}", item.content, item.executable) for item in collected.members]
    return _write(target, members, Solution(tuple(shlex.split(command or "")), mode))


def _pack_image(folder: Path, target: Path) -> Solution:
    image = layout.read(layout.files_of(folder)).config
    paths = sorted(path for path in folder.rglob("*") if not path.is_dir())
    members = [archive.Member(f"solution/{path.relative_to(folder).as_posix()}", path) for path in paths]
    return _write(target, members, Solution((), CONTAINER, image))


def _write(target: Path, members: Sequence[archive.Member], solution: Solution) -> Solution:
    about = {"version": 1, "command": list(solution.command), "mode": solution.mode}
    archive.write(target, [*members, archive.Member(ABOUT, json.dumps(about, sort_keys=True).encode())])
    return solution


def check(path: Path, challenge: Challenge, phase: Phase) -> Solution:
    """Return how an uploaded archive runs; raises BenchbotError for one that is not sound, or not admitted.

    Nothing of it is run, or written anywhere. An image is read to its end, all that is in its layers, too.
    """
    solution = examined(path)
    require_admitted(solution.mode, phase.modes, phase.title)
    if solution.image is not None:
        with archive.opened(path) as found:
            layout.check(_image_in(found), challenge.unpacked_bytes)
    return solution


def require_admitted(mode: str, modes: Sequence[str], phase: str) -> None:
    """Raise BenchbotError unless a mode is one of those that a phase, which people call so, admits."""
    if mode not in modes:
        raise BenchbotError(
            f"A solution in a {mode} is not admitted to {phase}.",
            f"Admitted: {', '.join(modes)}.",
            "Hand it in with a command (a sandbox), or without one as an image or with a Dockerfile (a container).",
        )


def unpack(path: Path, folder: Path) -> Solution:
    """Write a checked archive's solution into a new folder, and return how it runs."""
    solution = examined(path)
    folder.mkdir(parents=True)
    with archive.opened(path) as found:
        found.extract("solution", folder)
    return solution


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def examined(path: Path) -> Solution:
    """Return how an archive runs; raises BenchbotError for one that is not sound. Layers of an image are not read."""
    with archive.opened(path) as found:
        about = found.members.get(ABOUT)
        has_files = any(name.startswith("solution/") for name in found.members)
        if about is not None and about.size_bytes <= MOST_ABOUT_BYTES and has_files:
            return _with_image(_solution(path, about.read()), found)
    with bundle_file.opened(path) as bundle:
        ran = bundle.manifest["solution"]
        mode = CONTAINER if ran["mode"] == solution_source.CONTAINER else SANDBOX
        return _with_image(Solution(tuple(ran["command"]), mode), bundle.archive)


def _with_image(solution: Solution, found: archive.Archive) -> Solution:
    if solution.mode != CONTAINER or f"solution/{layout.MARKER}" not in found.members:
        return solution
    return replace(solution, image=layout.read(_image_in(found)).config)


def _image_in(found: archive.Archive) -> layout.Files:
    below = "solution/"
    members = {name.removeprefix(below): member for name, member in found.members.items() if name.startswith(below)}
    return {name: member.opened for name, member in members.items()}


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
