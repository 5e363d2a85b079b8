"""Add-ons of BenchBot v2 on the command line: which folders, and asking whether their code may run.

`--addons FOLDER` and `--trust-addons` are taken out of the words of a command before typer reads them: commands that
list things answer faster than typer reads an option, and `--list-tasks` must know the add-ons wherever it stands.
"""

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.core.errors import BenchbotError
from benchbot.core.resources import installed_addons

if TYPE_CHECKING:
    from benchbot.plugins.v2.addons import Addon

COMMANDS = (
    *("run", "submit", "batch", "eval", "report", "compare", "picture", "list", "show", "check", "doctor"),
    *("bundle", "reproduce", "verify"),
)


def take(words: Sequence[str]) -> list[str]:
    """Return the words without those about add-ons, which are in use from now on. What follows `--` stays as it is."""
    rest: list[str] = []
    folders: list[Path] = []
    trusted = False
    left = list(words)
    while left and left[0] != "--":
        word = left.pop(0)
        if word == "--trust-addons":
            trusted = True
        elif word == "--addons" or word.startswith("--addons="):
            folder = word.partition("=")[2] or (left.pop(0) if "=" not in word and left else "")
            if not folder:
                raise BenchbotError(
                    "--addons names no folder.",
                    "It is followed by a folder with add-ons of BenchBot v2.",
                    "Write it like this: --addons FOLDER",
                )
            folders.append(Path(folder))
        else:
            rest.append(word)
    if folders or trusted or os.environ.get("BENCHBOT_ADDONS") or installed_addons().is_dir():
        _use(folders, trusted=trusted)
    return rest + left


def _use(folders: Sequence[Path], *, trusted: bool) -> None:
    from benchbot.core import plugin_manager
    from benchbot.plugins.v2 import addons, trust

    for folder in folders:
        addons.find(folder)
    addons.use(folders)
    plugin_manager.load.cache_clear()
    trust.ask_with(_ask if sys.stdin.isatty() and sys.stderr.isatty() else None)
    if trusted:
        found = addons.from_environment()
        if not found:
            raise BenchbotError(
                "There are no add-ons to trust.",
                "--trust-addons is about the code of add-ons of BenchBot v2, and no folder was named.",
                "Name it: --addons FOLDER --trust-addons",
            )
        for addon in found:
            trust.remember(addon)


def _ask(addon: "Addon") -> bool:
    import typer

    from benchbot.plugins.v2 import trust

    what = f"The add-ons in {addon.root} have Python code, which would run with all your rights: "
    return typer.confirm(f"{what}{trust.files_shown(addon)}.\nLet it run, now and until it changes?", err=True)
