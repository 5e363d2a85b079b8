"""The command of a solution, as another machine can run it: in the solution's folder, by names relative to that."""

import re
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles.sources import Source

CONTAINER = "container"
"""The mode of results whose solution ran in a container."""

_PYTHON = re.compile(r"python(\d+(\.\d+)?)?")


def portable(solution: Mapping[str, Any], source: Source) -> list[str]:
    """Return the command that a result was made by, without anything that only its own machine has.

    Raises BenchbotError when it names files that are not in the source, or were others when the result was made.
    """
    words = [str(word) for word in solution.get("command") or ()]
    if not words:
        raise BenchbotError(
            "The result does not say which command made it.",
            "Its provenance has none.",
            "Name the command, as it is run in the solution's folder: --command 'python solution.py'",
        )
    if solution.get("mode") == CONTAINER:
        if not {"Dockerfile", "Containerfile"} & {member.path for member in source.members}:
            raise BenchbotError(
                f"There is no Dockerfile in {source.folder}.",
                "The results were made in a container of one.",
                "Name the folder of the Dockerfile with --solution.",
            )
        return words[1:]  # the first is the image's name
    folder = source.folder.resolve()
    portable_words = [_program(words[0], folder), *(_relative(word, folder) or word for word in words[1:])]
    members = {member.path: member for member in source.members}
    for word, digest in (solution.get("files") or {}).items():
        name = (_relative(word, folder) or word).removeprefix("./")
        if name not in members:
            raise BenchbotError(
                f"The solution names '{word}', which is not in {source.folder}.",
                "On another machine it would not be found.",
                "Name the folder that the command ran in with --solution; or the command, as it runs in the "
                "solution's folder, with --command.",
            )
        with members[name].opened() as content:
            if sha256(content.read()).hexdigest() != digest:
                raise BenchbotError(
                    f"{name} is not as it was when the result was made.",
                    "The bundle would hold another solution than the one that its results are of.",
                    "Check out what it was then, or run the solution again.",
                )
    left = [word for word in portable_words if _is_of_this_machine(word)]
    if left:
        raise BenchbotError(
            f"The solution's command names {left[0]}.",
            "Another machine does not have it.",
            "Put it into the solution's folder, and name the command that finds it there: --command '…'",
        )
    return portable_words


def _is_of_this_machine(word: str) -> bool:
    path = Path(word)
    return path.is_absolute() and path.exists() and not word.startswith(("/usr/bin/", "/bin/", "/dev/"))


def _program(word: str, folder: Path) -> str:
    """Return the first word: the interpreter by its name, which every machine finds."""
    if not Path(word).is_absolute():
        return "python" if _PYTHON.fullmatch(word) else word
    return _relative(word, folder) or ("python" if _PYTHON.fullmatch(Path(word).name) else word)


def _relative(word: str, folder: Path) -> str | None:
    """Return an absolute path below the folder relative to it; None for every other word."""
    path = Path(word)
    if not path.is_absolute():
        return None
    # The file itself may be a link; it is its folder's name that may be spelled in two ways.
    named = path.parent.resolve() / path.name
    return named.relative_to(folder).as_posix() if named.is_relative_to(folder) else None
