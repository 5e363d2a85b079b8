"""`benchbot upgrade`: plug-ins to their newest versions."""

from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.plugins.installer.prompts import (
    DryRun,
    ExtraIndexUrl,
    FindLinks,
    IndexUrl,
    InstallerName,
    NoIndex,
    Trust,
    indexes_of,
    perform,
)

if TYPE_CHECKING:
    from benchbot.plugins.installer.change import Site, Wish


def upgrade(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME…", help="Plug-ins and add-ons. [default: all]")
    ] = None,
    trust: Trust = False,
    dry_run: DryRun = False,
    index_url: IndexUrl = None,
    extra_index_url: ExtraIndexUrl = None,
    no_index: NoIndex = False,
    find_links: FindLinks = None,
    installer: InstallerName = None,
    as_json: Json = False,
) -> None:
    """Upgrade plug-ins to the newest versions that fit together, from where each came. Prints what has changed."""
    from benchbot.plugins.installer import upgrading
    from benchbot.plugins.installer.change import Wish

    def wish(site: "Site") -> "Wish":
        sources, newest, notes = upgrading.sources(names or (), site.installed)
        for note in notes:
            console.note(note)
        indexes = indexes_of(index_url, extra_index_url, no_index, find_links)
        return Wish(sources, upgrade=newest, indexes=indexes, may_build=trust, dry_run=dry_run)

    perform(" ".join(["benchbot upgrade", *(names or ())]), wish, installer=installer, trust=trust, as_json=as_json)
