"""Whose code may run: what the user has said so of, remembered by content.

Trust is a file named by a hash of the code in the folder `trusted` of the state folder. Other code has another hash, so
it is asked for again. To take trust back, delete the file: its text says what it is about.
"""

from pathlib import Path

from benchbot.core import resources
from benchbot.core.errors import BenchbotError


def given(digest: str) -> bool:
    """Say whether the user trusts the code with this hash."""
    return _mark(digest).is_file()


def give(digest: str, what: str) -> None:
    """Remember that the user trusts the code with this hash; raises BenchbotError when it cannot be remembered."""
    path = _mark(digest)
    try:
        path.parent.mkdir(mode=0o700, exist_ok=True)
        path.write_text(f"{what}\n", "utf-8")
    except OSError as error:
        raise BenchbotError(
            "It cannot be remembered what you trust.",
            f"{path}: {error.strerror}.",
            "Free some disk space, or name a folder that is yours to write: export BENCHBOT_STATE_DIR=…",
        ) from error


def _mark(digest: str) -> Path:
    return resources.state_dir() / "trusted" / digest
