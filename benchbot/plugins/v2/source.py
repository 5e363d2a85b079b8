"""Add-ons of BenchBot v2 as a source of declarations, and their options on the command line.

`--addons FOLDER` and `--trust-addons` are taken out of the words of a command before typer reads them: commands that
list things answer faster than typer reads an option, and `--list-tasks` must know the add-ons wherever it stands.
"""

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.cli.kit import console
from benchbot.core import plugin_manager
from benchbot.core.errors import BenchbotError
from benchbot.core.records import Evaluator
from benchbot.plugins.v2 import addons, methods, official, trust
from benchbot.plugins.v2.addons import Addon


@dataclass(frozen=True)
class AddonFolder(Addon):
    """A folder of add-ons as the catalog sees it (`benchbot.core.records.DeclarationFolder`).

    Of the `official` ones in it, or of all others. What official ones declare stands in for what plug-ins do not have.
    """

    official: bool = False
    version = "v2"

    @property
    def stands_in(self) -> bool:
        """Whether its declarations give way to others of the same name."""
        return self.official

    def sources(self, kind: str) -> list[Path]:
        """Return the folders that declare things of a kind, without those that an installed plug-in replaces."""
        found = ((folder, official.repository(folder, self.root)) for folder in super().sources(kind))
        if not self.official:
            return [folder for folder, name in found if name is None]
        # Files of ground truths have no names that could give way, and the code of a method is not a declaration's.
        there = distributions() if kind in ("ground_truths", "evaluation_methods") else set()
        return [folder for folder, name in found if name and not (there and official.is_installed(name, there))]

    def evaluators(self) -> Iterator[Evaluator | BenchbotError]:
        """Yield its evaluation methods, and what is wrong with those that cannot be read."""
        return methods.evaluators(self)

    def functions(self, declaration: Path, names: Mapping[str, str]) -> dict[str, Callable[..., Any]]:
        """Return the functions that a declaration names; raises BenchbotError for one that is not there."""
        return self.code.functions(declaration, dict(names))

    def require_trust(self) -> None:
        """Raise BenchbotError unless the user has allowed its code to run."""
        trust.require(self)

    def removal(self) -> str:
        """Return the command that removes it."""
        installed = addons.installed_folder()
        if self.root.is_relative_to(installed):
            return f"benchbot uninstall {self.root.relative_to(installed).as_posix()}"
        return f"leave out --addons {self.root}"


def folders() -> list[AddonFolder]:
    """Return the add-ons in use: those of `BENCHBOT_ADDONS`, and those installed."""
    found = addons.from_environment()
    return [AddonFolder(addon.root, addon.folders, is_official) for is_official in (False, True) for addon in found]


def distributions() -> set[str]:
    """Return the distributions of the plug-ins that are in use."""
    return {info.distribution for info in plugin_manager.installed()}


def installed() -> list[dict[str, str]]:
    """Return the installed add-ons as rows of `benchbot list plugins`."""
    found = addons.installed().items()
    return [{"name": name, "module": str(path), "distribution": name, "version": "v2"} for name, path in found]


def take_options(words: Sequence[str]) -> list[str]:
    """Return the words without those about add-ons, which are in use from now on. What follows `--` stays as it is."""
    rest: list[str] = []
    named: list[Path] = []
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
            named.append(Path(folder))
        else:
            rest.append(word)
    _use(named, trusted=trusted)
    return rest + left


def _use(named: Sequence[Path], *, trusted: bool) -> None:
    for folder in named:
        named_addon = addons.find(folder)
        known = (official.repository(each, named_addon.root) for each in named_addon.folders)
        names = sorted({name for name in known if name is not None})
        if names:
            console.note(f"What BenchBot ships is not taken from {', '.join(names)}: benchbot migrate {folder}")
    addons.use(named)
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


def _ask(addon: Addon) -> bool:
    code = f"The add-ons in {addon.root} have Python code, which would run with all your rights: "
    return console.confirmed(f"{code}{trust.files_shown(addon)}. Let it run, now and until it changes?")
