"""The source of a solution, as it goes into a bundle: what git does not ignore; no links, secrets or ground truth."""

import fnmatch
import json
import os
import re
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.bundles.archive import Member

MAX_BYTES = 512 * 2**20
SEARCHED_BYTES = 64 * 2**20
"""Larger files are not looked through for secrets and ground truth: they hold weights."""
LEFT_OUT = (
    *(".git", ".hg", ".svn", "__pycache__", ".venv", "venv", "node_modules", ".tox", ".nox", ".cache", ".idea"),
    *(".mypy_cache", ".pytest_cache", ".ruff_cache", ".hypothesis", ".ipynb_checkpoints", ".DS_Store", "*.pyc"),
    "*.egg-info",
)
"""Names of files and folders that are made again, or nobody else's business."""

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


@dataclass(frozen=True)
class Source:
    """The files of a solution, and the folder that its command runs in."""

    folder: Path
    members: tuple[Member, ...]
    """Their paths are relative to the folder."""


def collect(where: Path, leave_out: Sequence[str] = ()) -> Source:
    """Return a solution's source: a single file, or a folder's files but those that git ignores or nobody needs.

    Raises BenchbotError for links, secrets, ground truth, and for more than belongs into a bundle.
    """
    folder = where.parent if where.is_file() else where
    if not where.exists():
        raise BenchbotError(
            f"There is no {where}.", "It was named as the solution.", "Name the solution's file, or its folder."
        )
    names = [where.name] if where.is_file() else sorted(_listed(folder))
    kept = [name for name in names if not _matches(name, (*LEFT_OUT, *leave_out))]
    for name in kept:
        _require_plain(folder, name)
    _require_size(where, sum((folder / name).stat().st_size for name in kept))
    if not kept:
        raise BenchbotError(
            f"There is no source in {where}.", "Every file in it is left out.", "Name the solution's folder."
        )
    for name in kept:
        _require_no_secret(folder / name, name)
        _require_no_truth(folder / name, name)
    members = [Member(name, folder / name, os.access(folder / name, os.X_OK)) for name in kept]
    return Source(folder, tuple(members))


def _listed(folder: Path) -> set[str]:
    """Return the files in a folder and below, relative to it: those that git knows or would add, or else all."""
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
    """Say whether a path, or the name of one of its folders or of itself, is as one of the patterns says."""
    parts = name.split("/")
    starts = ["/".join(parts[: number + 1]) for number in range(len(parts))]
    return any(fnmatch.fnmatchcase(text, pattern.rstrip("/")) for pattern in patterns for text in (*parts, *starts))


def _require_plain(folder: Path, name: str) -> None:
    path = folder / name
    if path.is_symlink() or not path.is_file():
        raise BenchbotError(
            f"{name} cannot be bundled.",
            "It is a link, a pipe or a device; on another machine it would mean something else.",
            f"Put a copy of what it stands for in its place, or leave it out: --leave-out {name}",
        )


def _require_size(where: Path, size_bytes: int) -> None:
    if size_bytes > MAX_BYTES:
        raise BenchbotError(
            f"The solution in {where} is too large for a bundle.",
            f"Its files are {size_bytes >> 20} MiB together; {MAX_BYTES >> 20} MiB are the most.",
            "Leave out what can be made or downloaded again: --leave-out PATTERN (repeatable).",
        )


def _require_no_secret(path: Path, name: str) -> None:
    last = name.rpartition("/")[2]
    found = None
    if _matches(last, _SECRET_NAMES) and last not in _HARMLESS_NAMES:
        found = "a file of secrets, by its name"
    elif path.stat().st_size <= SEARCHED_BYTES:
        content = path.read_bytes()
        found = next((what for what, text in _SECRET_TEXTS.items() if re.search(text, content)), None)
    if found is not None:
        raise BenchbotError(
            f"{name} must not be given away.",
            f"It is, or holds, {found}; whoever gets the bundle could use it.",
            f"Leave it out: --leave-out {name}",
        )


def _require_no_truth(path: Path, name: str) -> None:
    if path.suffix.lower() != ".json" or path.stat().st_size > SEARCHED_BYTES:
        return
    try:
        document = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return
    if isinstance(document, dict) and "ground_truth" in document:
        raise BenchbotError(
            f"{name} must not be given away.",
            "It is a ground truth: with it every result can be made perfect.",
            f"Leave it out: --leave-out {name}",
        )
