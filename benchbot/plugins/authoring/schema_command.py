"""`benchbot schema`: the JSON Schemas of declarations and documents, with the names that are installed here."""

from pathlib import Path
from typing import Annotated, Any

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import Json


def schema(
    kind: Annotated[
        str | None,
        typer.Argument(metavar="[KIND]", help="task, robot, environment, result, …; without, all are listed."),
    ] = None,
    plain: Annotated[
        bool, typer.Option("--plain", help="As BenchBot brings it, without names of what is installed.")
    ] = False,
    folder: Annotated[
        Path | None, typer.Option("--write", metavar="DIR", help="Write it, or all, as DIR/KIND.json, for editors.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Print the JSON Schema (2020-12) of a kind of declaration or document, or list the kinds.

    Where a declaration names something, the schema offers the names that are installed; it allows others as well.
    """
    from benchbot.core.declarations import schema as schemas

    kinds = schemas.KINDS if kind is None else (_known(kind),)
    if folder is not None:
        _write(folder, {name: _schema(name, plain=plain) for name in kinds})
    elif kind is not None:
        console.data_json(_schema(kinds[0], plain=plain))
    else:
        rows = [{"kind": name, "title": schemas.schema(name)["title"]} for name in kinds]
        if as_json:
            console.data_json(rows)
        else:
            console.table(["kind", "title"], ([row["kind"], row["title"]] for row in rows))


def _known(kind: str) -> str:
    from benchbot.core.declarations import schema as schemas
    from benchbot.core.errors import BenchbotError, did_you_mean

    name = kind.replace("-", "_")
    if name not in schemas.KINDS:
        raise BenchbotError(
            f"There is no schema of '{kind}'.",
            f"Known: {', '.join(schemas.KINDS)}.{did_you_mean(name, list(schemas.KINDS))}",
            "Name one of these: benchbot schema task",
        )
    return name


def _schema(kind: str, *, plain: bool) -> dict[str, Any]:
    from benchbot.core.declarations import schema as schemas

    if plain:
        return schemas.schema(kind)
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import load
    from benchbot.plugins.authoring.checks.references import KnownNames, schema_with_names

    return schema_with_names(kind, KnownNames(Catalog(load()), []))


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
