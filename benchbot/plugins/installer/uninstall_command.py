"""`benchbot uninstall`: plug-ins and add-ons out of this environment."""

from typing import TYPE_CHECKING, Annotated

import typer

from benchbot.cli.kit.options import Json
from benchbot.plugins.installer.prompts import DryRun, InstallerName, perform

if TYPE_CHECKING:
    from benchbot.plugins.installer.change import Site, Wish


def uninstall(
    names: Annotated[list[str], typer.Argument(metavar="NAME…", help="Distributions, or add-ons as user/repository.")],
    dry_run: DryRun = False,
    installer: InstallerName = None,
    as_json: Json = False,
) -> None:
    """Uninstall plug-ins; what they needed stays. Prints what has changed."""
    from benchbot.plugins.installer.change import Wish

    def wish(_: "Site") -> "Wish":
        return Wish(remove=list(dict.fromkeys(names)), dry_run=dry_run)

    perform(f"benchbot uninstall {' '.join(names)}", wish, installer=installer, as_json=as_json)
