"""`benchbot stop`: the end of a run."""

from benchbot.cli import report


def stop() -> None:
    """End the newest back end that benchbot run started, as Ctrl-C in its terminal would."""
    from benchbot.api.client import Client
    from benchbot.supervisor.run_state import find

    connection = find()
    client = Client(connection)
    try:
        client.stop()
    finally:
        client.close()
    report.note(f"The back end at {connection.url or connection.socket} is ending.")
