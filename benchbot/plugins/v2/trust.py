"""Trust in the code of v2's add-ons and of the installer's packages: given by the user, remembered by content.

Trust is a file named by a hash of the code in the folder `trusted` of the state folder. Other code has another hash, so
it is asked for again. To take trust back, delete the file: its text says what it is about.
"""

from collections.abc import Callable
from pathlib import Path

from benchbot.core import resources
from benchbot.core.errors import BenchbotError
from benchbot.plugins.v2.addons import Addon

SHOWN_FILES = 10

_ask: Callable[[Addon], bool] | None = None
_declined: set[str] = set()


def ask_with(ask: Callable[[Addon], bool] | None) -> None:
    """Say how to ask the user whether an add-on's code may run; None where there is nobody to ask."""
    global _ask
    _ask = ask


def remember(addon: Addon) -> None:
    """Let the code of an add-on run, now and later, until it changes."""
    give(addon.code.digest, str(addon.root))


def require(addon: Addon) -> None:
    """Return when the code of an add-on may run; raises BenchbotError when the user has not said so."""
    if given(addon.code.digest):
        return
    if _ask is not None and addon.code.digest not in _declined:
        if _ask(addon):
            remember(addon)
            return
        _declined.add(addon.code.digest)
    raise BenchbotError(
        f"The code of the add-ons in {addon.root} is not trusted.",
        f"It would run with all your rights, and you have not allowed it, or it has changed: {files_shown(addon)}.",
        "Look at it; if you trust it, give --trust-addons once. It is remembered until the code changes.",
    )


def files_shown(addon: Addon) -> str:
    """Return the names of an add-on's Python files in its folder, the first of them where there are many."""
    names = [path.relative_to(addon.root).as_posix() for path in addon.code.files if path.suffix == ".py"]
    more = [f"and {len(names) - SHOWN_FILES} more"] if len(names) > SHOWN_FILES else []
    return ", ".join(names[:SHOWN_FILES] + more)


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
