"""`benchbot plugins`: what is installed, from metadata alone."""

from benchbot.cli import list as lists
from benchbot.cli.options import QUICK, group

app = group("Say which plug-ins are installed.")


@app.callback()
def plugins() -> None:
    """Say which plug-ins are installed."""


app.command("list", context_settings=QUICK)(lists.plugins)
