"""`benchbot schema`: the JSON Schemas of declarations, documents and formats, with names that are installed here."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json

if TYPE_CHECKING:
    from benchbot.core.declarations.catalog import Catalog


def schema(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="task, robot, result, object_map, …; without, all are listed."),
    ] = None,
    plain: Annotated[
        bool, typer.Option("--plain", help="As BenchBot brings it, without names of what is installed.")
    ] = False,
    folder: Annotated[
        Path | None, typer.Option("--write", metavar="DIR", help="Write it, or all, as DIR/NAME.json, for editors.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the JSON Schema (2020-12) of a kind of declaration or document, or of a format of results; or list all.

    Where a declaration names something, the schema offers the names that are installed; it allows others as well.
    """
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load

    catalog = Catalog(load())
    titles = _titles(catalog)
    names = list(titles) if name is None else [_known(name, list(titles), catalog)]
    if folder is not None:
        _write(folder, {known: _schema(known, catalog, plain=plain) for known in names})
    elif name is not None:
        console.data_json(_schema(names[0], catalog, plain=plain))
    elif as_json:
        console.data_json([{"kind": known, "title": title} for known, title in titles.items()])
    else:
        console.table(["kind", "title"], ([known, title] for known, title in titles.items()))


def _titles(catalog: "Catalog") -> dict[str, str]:
    """Return what each schema is of: the kinds of declarations and documents, then the formats that have one."""
    from benchbot.core.declarations import schema as schemas

    formats = {name: item.data for name, item in sorted(catalog.pool("formats").items()) if item.data.get("schema")}
    return {
        **{kind: str(schemas.schema(kind)["title"]) for kind in schemas.KINDS},
        **{name: str(data.get("description", "")) for name, data in formats.items() if name not in schemas.KINDS},
    }


def _known(name: str, known: list[str], catalog: "Catalog") -> str:
    from benchbot.core.errors import BenchbotError, did_you_mean

    wanted = name if name in known else name.replace("-", "_")
    if wanted in known:
        return wanted
    if wanted in catalog.names("formats"):
        raise BenchbotError(
            f"The format '{wanted}' brings no schema.",
            "Its declaration names none under the key 'schema'.",
            f"See its functions: benchbot show format {wanted}",
        )
    raise BenchbotError(
        f"There is no schema of '{name}'.",
        f"Known: {', '.join(known)}.{did_you_mean(wanted, known)}",
        "Name one of these: benchbot schema task",
    )


def _schema(name: str, catalog: "Catalog", *, plain: bool) -> dict[str, Any]:
    from benchbot.core.declarations import schema as schemas
    from benchbot.plugins.authoring.checks.references import KnownNames, schema_with_names

    if name not in schemas.KINDS:
        declared = catalog.get("formats", name)
        return schemas.read(declared.path.parent / str(declared.data["schema"]))
    return schemas.schema(name) if plain else schema_with_names(name, KnownNames(catalog, []))


def _write(folder: Path, documents: dict[str, dict[str, Any]]) -> None:
    from benchbot.core.declarations.schema import write_schemas
    from benchbot.core.errors import BenchbotError

    try:
        paths = write_schemas(folder, documents)
    except OSError as error:
        raise BenchbotError(
            f"The schemas cannot be written to {folder}.",
            f"{error.filename}: {error.strerror}",
            "Name a folder that you may write to: --write DIR",
        ) from error
    console.data(*map(str, paths))
    console.note(f"An editor uses one for a file that begins with: # yaml-language-server: $schema={paths[0]}")
