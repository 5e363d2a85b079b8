"""`benchbot migrate`: what becomes of a folder of BenchBot v2's add-ons."""

import os
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json
from benchbot.core.errors import ExitCode


def migrate(
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="Add-ons of BenchBot v2, one or many.")],
    as_json: Json = False,
) -> None:
    """Say what of a folder of BenchBot v2's add-ons will run here, what differs, and why. Nothing of it is run.

    It exits with 2 when something will not run.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import Plugins, installed
    from benchbot.plugins.v2 import addons, migration, source

    found = migration.read(addons.find(folder))
    os.environ[addons.VARIABLE] = ""  # what there is without the folder
    rows = migration.judged(found, Catalog(Plugins(installed())))
    needed = list(dict.fromkeys(migration.needs(found, source.distributions())))
    if as_json:
        told = [{**vars(row), "path": str(row.path)} for row in rows]
        console.data_json({"folder": str(found.addon.root), "declarations": told, "needs": needed})
    else:
        lines = [(row.kind, row.name, row.verdict.value, row.why) for row in rows]
        console.table(("kind", "name", "here", "why"), lines)
        console.note(*needed)
    count = Counter(row.verdict for row in rows)
    console.note(", ".join(f"{number} {verdict.value}" for verdict, number in sorted(count.items())) + ".")
    if any(row.verdict not in migration.USABLE for row in rows):
        raise typer.Exit(ExitCode.USAGE)
    console.note(
        f"Use it: benchbot submit --addons {folder} …   Or have it found everywhere: benchbot install {folder}"
    )
