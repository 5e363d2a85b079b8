"""Command lines of the documentation, parsed as they would be and not run."""

import re
import shlex
from typing import Any

import typer

from benchbot.cli.app import Settings, app

# A reader's own add-ons are not here; what belongs to the shell is not ours.
_NOT_PARSED = re.compile(r"--(?:addons|recording)\s+\S+|--trust-addons|'[|>]'.*")


def parsed(command: str) -> Any:
    """Return the context of the innermost command, its arguments parsed and checked; nothing is run."""
    group = typer.main.get_command(app)
    rest = shlex.split(_NOT_PARSED.sub("", command))[1:]
    context = group.make_context("benchbot", rest, obj=Settings())
    while hasattr(group, "resolve_command") and (rest := [*context._protected_args, *context.args]):
        name, group, rest = group.resolve_command(context, rest)
        context = group.make_context(name, rest, parent=context)
    return context
