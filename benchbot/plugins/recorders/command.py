"""`benchbot record`: recordings of a run that is under way, from another terminal."""

import time
from pathlib import Path
from typing import Annotated

import typer

from benchbot.cli.kit import console
from benchbot.cli.kit.options import tell_recordings
from benchbot.core.errors import BenchbotError

POLL_S = 0.5
DEFAULT = "mcap"


def record(
    recorders: Annotated[
        str | None,
        typer.Argument(
            metavar="[RECORDER,…]", help="What to record with: see benchbot list recorders. [default: mcap]"
        ),
    ] = None,
    run: Annotated[
        str | None,
        typer.Option(
            "--run", metavar="ID", help="The run: a part of its name that no other has. [default: the only one]"
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output-location",
            "-o",
            metavar="FOLDER",
            help="Write into FOLDER/RECORDER. [default: a folder of BenchBot's own]",
        ),
    ] = None,
) -> None:
    """Record a run that is under way, from its next observation on; Ctrl-C or the run's end finishes the recording.

    The run does not notice: it is recorded by a process of its own. The recordings' folders go to stdout.
    """
    from dataclasses import replace

    from benchbot.api.client import Client
    from benchbot.cli.kit.console import interrupting
    from benchbot.cli.kit.options import recordings
    from benchbot.core.plugin_manager import load
    from benchbot.wire import joining, run_state

    state = joining.chosen() if run is None else joining.named(run, run_state.live())
    names = recordings([recorders or DEFAULT])
    folders = {name: folder if output is None else output / name for name, folder in names.items()}
    for name in folders:
        load().record("recorders", name)  # raises before the run is asked to record
    client = Client(replace(state.connection, token=state.operator_token))
    ours = {str(folder.absolute()) for folder in folders.values()}
    with interrupting():
        try:
            going_on = client.record(folders)
            console.note(f"Recording {state.task} on {state.robot} in {state.environment}. Ctrl-C finishes it.")
            while any(entry["folder"] in ours and not entry["ended"] for entry in going_on):
                time.sleep(POLL_S)
                try:
                    going_on = client.record()
                except BenchbotError:  # the run has ended
                    break
        except KeyboardInterrupt:
            try:
                client.record(finish=list(folders.values()))
            except BenchbotError as error:
                console.note(f"The run has ended, too: {error.why}")
    tell_recordings(folders)
    for folder in folders.values():
        console.data(str(folder))
