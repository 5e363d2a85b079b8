"""`benchbot view`: results in the browser, by a server of one's own or as files."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console


def view(
    folders: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME=]FOLDER",
            help="Folders of results, batches, single results. [default: this folder, your batches and runs]",
        ),
    ] = None,
    port: Annotated[
        int, typer.Option("--port", metavar="PORT", min=0, max=65535, help="Of this machine alone; 0 is any free one.")
    ] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open it in the browser.")] = True,
    export: Annotated[
        Path | None,
        typer.Option("--export", metavar="FOLDER", help="Write pages that need no server, without ground truth."),
    ] = None,
    with_ground_truth: Annotated[
        bool, typer.Option("--with-ground-truth", help="With --export: what truly stands there, and diagnoses, too.")
    ] = False,
    with_hidden: Annotated[
        bool, typer.Option("--with-hidden", help="With --export: hidden places, too: who gets the files, knows them.")
    ] = False,
) -> None:
    """Look at runs, batches and episodes in the browser: find, scrub, compare.

    The pages hold ground truth, and answer only this user's browser: the address has a token.
    """
    from benchbot_view.index import Index, Source

    sources = [Source.of(text) for text in folders or ["."]]
    title = ", ".join(source.name for source in sources)
    index = Index(sources, everything=not folders)
    if export is not None:
        from benchbot.cli.kit.status_line import working
        from benchbot_view.export import write

        with working("Writing the pages"):
            page = write(index, title, export, with_ground_truth=with_ground_truth, with_hidden=with_hidden)
        console.data(str(page))
        return
    from benchbot_view.server import serve

    def tell(address: str) -> None:
        console.note("In a browser of this machine (Ctrl-C ends it):")
        console.data(address)
        # Without a display, it would be one of the terminal's.
        if browser and (sys.platform == "darwin" or {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()):
            import webbrowser

            webbrowser.open(address)

    serve(index, title, port, tell)
