"""`benchbot assets`: packs of models for scenes."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json, group
from benchbot.cli.kit.status_line import counted, working
from benchbot.plugin import BenchbotError, did_you_mean

INSTALLABLE = {"sweethome3d": "820 pieces of furniture of Sweet Home 3D (Debian's sweethome3d-furniture)"}

app = group("List packs of 3D models that scenes are furnished with, and install more.")


@app.command("list")
def list_(
    pack: Annotated[str | None, typer.Argument(metavar="PACK", help="List the models of this pack.")] = None,
    as_json: Json = False,
) -> None:
    """List the asset packs that are installed, or the models of one."""
    from benchbot.plugin import load_plugins as load
    from benchbot_scenes.catalogue import load_catalogue
    from benchbot_scenes.variations import VARIATIONS

    pool = load().pool("asset_packs")
    if pack is not None and pack not in pool:
        raise BenchbotError(
            f"There is no asset pack '{pack}' here.",
            f"Installed: {', '.join(sorted(pool)) or 'none'}.{did_you_mean(pack, list(pool))}",
            f"Packs that can be installed: benchbot assets install {' | '.join(INSTALLABLE)}",
        )
    if pack is None:
        columns = ["name", "models", "classes", "distribution"]
        rows = []
        for name, provided in sorted(pool.items()):
            models = load_catalogue(provided.value.catalogue).models.values()
            classes = {model.class_name for model in models} - {None}
            counts = {"models": len(models), "classes": len(classes)}
            origin = {"distribution": provided.distribution, "path": str(provided.value.catalogue)}
            rows.append({"name": name, **counts, **origin})
    else:
        columns = ["id", "class", "kind", "size_m", "triangles", "variations", "licence", "author"]
        models = load_catalogue(pool[pack].value.catalogue).models.values()
        rows = [
            {
                "id": model.id,
                "class": model.class_name,
                "kind": model.kind,
                "placement": model.placement,
                "size_m": list(model.size_m),
                "triangles": model.triangles,
                "variations": 0 if model.varies is None else VARIATIONS - 1,
                "licence": model.licence,
                "author": model.author,
                "source": model.source,
                "path": str(model.file),
            }
            for model in sorted(models, key=lambda model: model.id)
        ]
    if as_json:
        console.data_json(rows)
    else:
        console.table(columns, [[_cell(row[column]) for column in columns] for row in rows])


@app.command()
def install(
    pack: Annotated[str, typer.Argument(metavar="PACK", help=f"One of: {', '.join(INSTALLABLE)}.")],
    source: Annotated[
        Path | None,
        typer.Option("--from", metavar="PATH", help="The .deb or .sh3f, or a folder of such. [default: apt's]"),
    ] = None,
) -> None:
    """Fetch a pack's models and make assets of them; takes a minute or two.

    They are kept in your data folder, with a file CREDITS.txt that names authors and licences.
    """
    from benchbot_scenes.packs import sweethome3d

    if pack not in INSTALLABLE:
        raise BenchbotError(
            f"'{pack}' is not an asset pack that can be installed this way.",
            f"Those are: {', '.join(INSTALLABLE)}.{did_you_mean(pack, list(INSTALLABLE))}",
            "Other packs come as distributions: pip install NAME",
        )
    if source is not None and not source.exists():
        raise BenchbotError(f"There is no file {source}.", "The path names nothing.", "Check how it is written.")
    fetched = f"Fetching {sweethome3d.PACKAGE}, 120 MB where it is not here yet" if source is None else "Unpacking"
    with working(fetched):
        done = sweethome3d.install(source, partial(counted, "Converting models"))
    for line in done.left_out:
        console.note(f"Left out: {line}")
    console.note(f"{done.models} models in {done.path}")
    console.note(f"Use them in a run: benchbot run … --set assets={pack}")


@app.command()
def remove(pack: Annotated[str, typer.Argument(metavar="PACK", help="A pack that you have installed.")]) -> None:
    """Remove a pack that was installed with benchbot assets install."""
    from benchbot_scenes.packs import folder

    console.note(f"Removed: {folder.remove(pack)}")


def _cell(value: Any) -> str:
    if isinstance(value, list):
        return " x ".join(f"{number:.2f}" for number in value)
    return "-" if value is None else str(value)
