"""`benchbot install`: plug-ins and add-ons into this environment."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit.options import Json
from benchbot.plugins.installer.prompts import (
    DryRun,
    ExtraIndexUrl,
    FindLinks,
    IndexUrl,
    InstallerName,
    NoIndex,
    RequireHashes,
    Trust,
    indexes_of,
    perform,
)

if TYPE_CHECKING:
    from benchbot.plugins.installer.change import Site, Wish


def install(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME[==V]|PATH|GIT-URL|WHEEL…",
            help="From an index by name; a project's folder; a git repository; a wheel; or a folder or repository of "
            "BenchBot v2's add-ons.",
        ),
    ] = None,
    requirements: Annotated[
        list[Path] | None,
        typer.Option("--requirements", "-r", metavar="FILE", help="A file with one of them on each line; repeatable."),
    ] = None,
    trust: Trust = False,
    dry_run: DryRun = False,
    require_hashes: RequireHashes = False,
    index_url: IndexUrl = None,
    extra_index_url: ExtraIndexUrl = None,
    no_index: NoIndex = False,
    find_links: FindLinks = None,
    installer: InstallerName = None,
    as_json: Json = False,
) -> None:
    """Install plug-ins: look what would change, ask where code comes, install, check; what fails is undone.

    Prints what has changed.
    """
    from benchbot.core.errors import BenchbotError
    from benchbot.plugins.installer.change import Wish
    from benchbot.plugins.installer.requirements import read

    wanted = [*(sources or ()), *(line for path in requirements or () for line in read(path))]
    if not wanted:
        raise BenchbotError(
            "Nothing was named.", "There is nothing to install.", "Write: benchbot install NAME, or -r FILE"
        )

    def wish(_: "Site") -> "Wish":
        return Wish(
            wanted,
            indexes=indexes_of(index_url, extra_index_url, no_index, find_links),
            require_hashes=require_hashes,
            may_build=trust,
            dry_run=dry_run,
        )

    perform(f"benchbot install {' '.join(wanted)}", wish, installer=installer, trust=trust, as_json=as_json)
