"""Trust in the code of v2's add-ons: the user's consent to run it, remembered by content."""

from collections.abc import Callable

from benchbot.core import trust
from benchbot.core.errors import BenchbotError
from benchbot.plugins.v2.addons import Addon

SHOWN_FILES = 10

_ask: Callable[[Addon], bool] | None = None
_declined: set[str] = set()


def ask_with(ask: Callable[[Addon], bool] | None) -> None:
    """Set the question to the user whether an add-on's code may run; None where nobody can be asked."""
    global _ask
    _ask = ask


def remember(addon: Addon) -> None:
    """Allow the code of an add-on to run, now and later, until it changes."""
    trust.give(addon.code.digest, str(addon.root))


def require(addon: Addon) -> None:
    """Raise BenchbotError unless the user allows the code of an add-on to run; asks where that is possible."""
    if trust.given(addon.code.digest):
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
