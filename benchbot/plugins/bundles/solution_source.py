"""The source files of a solution, and the command that runs them on another machine.

Files that git ignores are left out; links, secrets and ground truth are refused.
"""

import fnmatch
import json
import os
import re
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles.archive import Member
from benchbot.plugins.bundles.snapshot import Snapshot
from benchbot.plugins.containers import context

MAX_BYTES = 512 * 2**20
SEARCHED_BYTES = 64 * 2**20
"""Larger files, such as weights, are not searched for secrets and ground truth."""
LEFT_OUT = (
    *(".git", ".hg", ".svn", "__pycache__", ".venv", "venv", "node_modules", ".tox", ".nox", ".cache", ".idea"),
    *(".mypy_cache", ".pytest_cache", ".ruff_cache", ".hypothesis", ".ipynb_checkpoints", ".DS_Store", "*.pyc"),
    "*.egg-info",
)
"""Names of files and folders that are generated or private."""

_SECRET_NAMES = (
    *(".env", ".env.*", ".netrc", "_netrc", ".pypirc", ".git-credentials", ".htpasswd", ".dockercfg"),
    *("id_rsa", "id_dsa", "id_ecdsa", "id_ed25519", "*.p12", "*.pfx", "*.kdbx", "*.keystore"),
)
_HARMLESS_NAMES = (".env.example", ".env.sample", ".env.template", ".env.dist")
_SECRET_TEXTS = {
    "a private key": rb"-----BEGIN (?:[A-Z0-9]+ )*PRIVATE KEY-----",
    "a token of GitHub": rb"\b(?:gh[oprsu]_[A-Za-z0-9]{36}|github_pat_[A-Za-z0-9_]{50})",
    "a key of Amazon Web Services": rb"\bAKIA[0-9A-Z]{16}\b",
    "a token of Hugging Face": rb"\bhf_[A-Za-z]{34}\b",
    "a token of Slack": rb"\bxox[abprs]-[0-9A-Za-z-]{20}",
    "a token of PyPI": rb"\bpypi-AgEIcHlwaS5vcmc",
}

CONTAINER = "container"
"""The mode of results whose solution ran in a container."""

_PYTHON = re.compile(r"python(\d+(\.\d+)?)?")


@dataclass(frozen=True)
class Source:
    """The files of a solution, and the folder that its command runs in."""

    folder: Path
    members: tuple[Member, ...]
    """Their paths are relative to the folder."""


def collect(where: Path, leave_out: Sequence[str] = (), names: Iterable[str] | None = None) -> Source:
    """Return a solution's source: a single file, or a folder's files without those in `LEFT_OUT` and `leave_out`.

    `names` are the files of a folder, where they are known. Raises BenchbotError for links, secrets, ground truth, and
    for more than `MAX_BYTES`.
    """
    folder = where.parent if where.is_file() else where
    if not where.exists():
        raise BenchbotError(
            f"There is no {where}.", "It was named as the solution.", "Name the solution's file, or its folder."
        )
    names = [where.name] if where.is_file() else sorted(_listed(folder) if names is None else names)
    kept = [name for name in names if not _matches(name, (*LEFT_OUT, *leave_out))]
    for name in kept:
        if (folder / name).is_symlink() or not (folder / name).is_file():
            raise BenchbotError(
                f"{name} cannot be bundled.",
                "It is a link, a pipe or a device; on another machine it would mean something else.",
                f"Put a copy of what it stands for in its place, or leave it out: --leave-out {name}",
            )
    size_bytes = sum((folder / name).stat().st_size for name in kept)
    if size_bytes > MAX_BYTES:
        raise BenchbotError(
            f"The solution in {where} is too large for a bundle.",
            f"Its files are {size_bytes >> 20} MiB together; {MAX_BYTES >> 20} MiB are the most.",
            "Leave out what can be made or downloaded again: --leave-out PATTERN (repeatable).",
        )
    if not kept:
        raise BenchbotError(
            f"There is no source in {where}.", "Every file in it is left out.", "Name the solution's folder."
        )
    for name in kept:
        secret = _secret(folder / name)
        why = f"It is, or holds, {secret}; whoever gets the bundle could use it." if secret else None
        if why is None and _is_ground_truth(folder / name):
            why = "It is a ground truth: with it every result can be made perfect."
        if why is not None:
            raise BenchbotError(f"{name} must not be given away.", why, f"Leave it out: --leave-out {name}")
    members = [Member(name, folder / name, os.access(folder / name, os.X_OK)) for name in kept]
    return Source(folder, tuple(members))


def of_snapshot(snapshot: Snapshot, leave_out: Sequence[str] = ()) -> Source:
    """Return the source that a snapshot holds; raises BenchbotError when it needs more than its folder to run."""
    content = snapshot.content
    if any(folder != content.folder for folder in content.search):
        raise BenchbotError(
            "The solution cannot be bundled as it ran.",
            f"It imports from folders that PYTHONPATH or an environment named: {', '.join(content.search)}",
            "Put all that it imports into its folder, or install it with it; then run it again.",
        )
    return collect(snapshot.files, leave_out, [*content.files, *content.links])


def require_content(source: Source, snapshot: Snapshot) -> None:
    """Raise BenchbotError unless a source holds the files of a snapshot, as far as these lie in its folder."""
    members = {item.path: item for item in source.members}
    folder = PurePosixPath(snapshot.content.folder)
    for name, expected in snapshot.content.files.items():
        path = PurePosixPath(name)
        inside = path.relative_to(folder).as_posix() if path.is_relative_to(folder) else None
        if inside is not None and (inside not in members or members[inside].sha256 != expected):
            raise BenchbotError(
                f"{name} is not as it was when the results were made.",
                "The bundle would hold another solution than the one that its results are of.",
                f"Leave --solution out: the batch has kept the solution that it ran ({snapshot.path}).",
            )


def _listed(folder: Path) -> set[str]:
    """Return the paths of files below a folder, relative to it: those that git tracks or would add, or else all."""
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), "ls-files", "-z", "--cached", "--others", "--exclude-standard"],  # noqa: S607
            capture_output=True,
            timeout=60,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return set(_walked(folder, folder))
    names = [os.fsdecode(name) for name in done.stdout.split(b"\0") if name]
    found = set[str]()
    for name in names:
        path = folder / name
        if path.is_dir() and not path.is_symlink():  # a submodule, or a repository within
            found |= set(_walked(path, folder))
        elif os.path.lexists(path):  # else it is deleted, though git still lists it
            found.add(name)
    return found or set(_walked(folder, folder))


def _walked(start: Path, folder: Path) -> Iterator[str]:
    for path, folders, files in os.walk(start):
        here = Path(path)
        # A link to a folder is among the folders: it is refused later, by name.
        links = [name for name in folders if (here / name).is_symlink()]
        folders[:] = [
            name
            for name in folders
            if name not in links and not _matches(name, LEFT_OUT) and not (here / name / "pyvenv.cfg").exists()
        ]
        for name in (*files, *links):
            yield (here / name).relative_to(folder).as_posix()


def _matches(name: str, patterns: Sequence[str]) -> bool:
    """Say whether a path, one of its folders, or the name of either matches one of the patterns."""
    parts = name.split("/")
    starts = ["/".join(parts[: number + 1]) for number in range(len(parts))]
    return any(fnmatch.fnmatchcase(text, pattern.rstrip("/")) for pattern in patterns for text in (*parts, *starts))


def _secret(path: Path) -> str | None:
    """Return a description of the secret that a file is or contains, or None."""
    if _matches(path.name, _SECRET_NAMES) and path.name not in _HARMLESS_NAMES:
        return "a file of secrets, by its name"
    if path.stat().st_size > SEARCHED_BYTES:
        return None
    content = path.read_bytes()
    return next((what for what, pattern in _SECRET_TEXTS.items() if re.search(pattern, content)), None)


def _is_ground_truth(path: Path) -> bool:
    if path.suffix.lower() != ".json" or path.stat().st_size > SEARCHED_BYTES:
        return False
    try:
        document = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return False
    return isinstance(document, dict) and "ground_truth" in document


def portable_command(solution: Mapping[str, Any], source: Source) -> list[str]:
    """Return the command of a result's provenance with paths relative to the source's folder.

    Raises BenchbotError when it names files that are not in the source, or that differed when the result was made.
    """
    words = [str(word) for word in solution.get("command") or ()]
    if not words:
        raise BenchbotError(
            "The result does not say which command made it.",
            "Its provenance has none.",
            "Name the command, as it is run in the solution's folder: --command 'python solution.py'",
        )
    if solution.get("changed_files"):
        raise BenchbotError(
            f"{solution['changed_files'][0]} was changed while the solution ran.",
            "Nobody can say which content of it made the result.",
            "Run the solution again, and leave its files alone until it has ended.",
        )
    if solution.get("mode") == CONTAINER:
        if not set(context.NAMES) & {member.path for member in source.members}:
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
        if members[name].sha256 != digest:
            raise BenchbotError(
                f"{name} is not as it was when the result was made.",
                "The bundle would hold another solution than the one that its results are of.",
                "Check out what it was then, or run the solution again.",
            )
    left = [word for word in portable_words if _exists_only_here(word)]
    if left:
        raise BenchbotError(
            f"The solution's command names {left[0]}.",
            "Another machine does not have it.",
            "Put it into the solution's folder, and name the command that finds it there: --command '…'",
        )
    return portable_words


def _exists_only_here(word: str) -> bool:
    path = Path(word)
    return path.is_absolute() and path.exists() and not word.startswith(("/usr/bin/", "/bin/", "/dev/"))


def _program(word: str, folder: Path) -> str:
    """Return the first word of a command; an interpreter becomes `python`, which every machine finds."""
    if not Path(word).is_absolute():
        return "python" if _PYTHON.fullmatch(word) else word
    return _relative(word, folder) or ("python" if _PYTHON.fullmatch(Path(word).name) else word)


def _relative(word: str, folder: Path) -> str | None:
    """Return an absolute path below the folder relative to it; None for every other word."""
    path = Path(word)
    if not path.is_absolute():
        return None
    # Links in the folder's path are followed, but not the file itself, which may be one.
    named = path.parent.resolve() / path.name
    return named.relative_to(folder).as_posix() if named.is_relative_to(folder) else None
