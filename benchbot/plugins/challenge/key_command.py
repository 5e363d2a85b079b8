"""`benchbot key`: keys that submissions are signed with."""

from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import QUICK
from benchbot.plugins.challenge.taking_part import require_extra

app = typer.Typer(
    help="Keys (Ed25519) that submissions are signed with.",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    context_settings=QUICK,
)

File = Annotated[Path, typer.Argument(metavar="FILE", help="The file of the private key; keep it to yourself.")]


@app.command()
def make(file: File) -> None:
    """Make a key in a new file; its public key goes to stdout."""
    require_extra()
    from benchbot.plugins.challenge import signing

    console.data_json(signing.make(file).public)
    console.note(f"The private key is in {file}, readable for you alone. What you hand in is yours by it: keep a copy.")


@app.command()
def show(file: File) -> None:
    """Print the public key of a file, as JSON."""
    require_extra()
    from benchbot.plugins.challenge import signing

    console.data_json(signing.load(file).public)
