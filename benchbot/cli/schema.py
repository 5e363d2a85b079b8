"""`benchbot schema`: the JSON Schema of a declaration or document."""

from typing import Annotated

import typer

from benchbot.cli import console


def schema(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="task, robot, environment, result, scores, …")],
) -> None:
    """Print the JSON Schema (2020-12) of a declaration or document."""
    from benchbot.core import schema as schemas
    from benchbot.core.errors import BenchbotError, did_you_mean

    name = kind.replace("-", "_")
    if name not in schemas.KINDS:
        raise BenchbotError(
            f"There is no schema of '{kind}'.",
            f"Known: {', '.join(schemas.KINDS)}.{did_you_mean(name, list(schemas.KINDS))}",
            "Name one of these: benchbot schema task",
        )
    console.data_json(schemas.schema(name))
