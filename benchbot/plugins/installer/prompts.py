"""What the commands that change the environment share: options, asking, and showing what would change."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.interrupting import interruptible

if TYPE_CHECKING:
    from benchbot.plugins.installer.change import Site, Wish
    from benchbot.plugins.installer.indexes import Indexes
    from benchbot.plugins.installer.plan import Plan

InstallerName = Annotated[
    str | None,
    typer.Option("--installer", metavar="uv|pip", help="What installs. [default: uv where there is one, else pip]"),
]
Trust = Annotated[bool, typer.Option("--trust", help="Let the code that comes run; remembered until it changes.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Print what would change, and change nothing.")]
RequireHashes = Annotated[bool, typer.Option("--require-hashes", help="Install only what a hash is given for.")]
IndexUrl = Annotated[str | None, typer.Option("--index-url", metavar="URL", help="The package index. [default: PyPI]")]
ExtraIndexUrl = Annotated[
    list[str] | None, typer.Option("--extra-index-url", metavar="URL", help="Another index, besides; repeatable.")
]
NoIndex = Annotated[bool, typer.Option("--no-index", help="Ask no index: only what --find-links names.")]
FindLinks = Annotated[
    list[Path] | None, typer.Option("--find-links", metavar="DIR", help="A folder of wheels; repeatable.")
]


def indexes_of(
    index_url: str | None, extra_index_url: list[str] | None, no_index: bool, find_links: list[Path] | None
) -> "Indexes":
    """Return where to look, from the options."""
    from benchbot.plugins.installer.indexes import Indexes

    return Indexes(index_url, tuple(extra_index_url or ()), no_index, tuple(find_links or ()))


@dataclass(frozen=True)
class Terminal:
    """The person who has typed the command: told on stderr, asked where there is a terminal."""

    trust: bool

    def note(self, text: str) -> None:
        """Say how it goes on."""
        console.note(text)

    def may_build(self, source: str) -> bool:
        """Ask whether a source's own code may run to build it."""
        return self.trust or _asked(f"To build {source}, its code runs with all your rights. Let it?")

    def agrees(self, plan: "Plan") -> bool:
        """Show what would change; where code comes that was never allowed, ask."""
        console.note(str(plan))
        if not plan.unsure or self.trust:
            return True
        names = ", ".join(change.name for change in plan.unsure)
        return _asked(
            f"The code of {names} would run with all your rights, also that of mere dependencies. Install it?"
        )


def _asked(question: str) -> bool:
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    try:
        return typer.confirm(question, err=True)
    except typer.Abort:  # what Ctrl-C becomes there
        raise KeyboardInterrupt from None


def perform(
    what: str,
    wish: "Callable[[Site], Wish]",
    *,
    installer: str | None,
    trust: bool = False,
    as_json: bool = False,
) -> None:
    """Do what is wished, in the environment that this is, and print what has changed.

    `what` is the command, as others who wait for it are told; `wish` is asked once the environment is held.
    """
    from benchbot.plugins.installer import environment
    from benchbot.plugins.installer.change import change, held
    from benchbot.plugins.installer.indexes import public

    with interruptible("nothing was changed."):
        person = Terminal(trust)
        with held(environment.current(), installer, public(what), person.note) as site:
            wished = wish(site)
            plan = change(site, wished, public(what), person)
    done = not wished.dry_run
    if as_json:
        console.data_json(plan.as_dict(installer=site.installer.name, done=done))
    elif plan.changes:
        console.data(str(plan))
    if not plan.changes:
        console.note("Nothing to do: everything is there already.")
    elif done:
        console.note("Done.")
