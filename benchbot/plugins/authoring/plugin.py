"""Making plug-ins: new projects, checks of declarations, schemas."""

from collections.abc import Iterator

from benchbot.plugin import Command, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the commands."""
    yield Command(
        "check",
        "benchbot.plugins.authoring.check_command:check",
        "Say what is wrong with declarations and documents, line by line.",
        takes_sources=True,
    )
    yield Command(
        "new",
        "benchbot.plugins.authoring.new_command:new",
        "Make a plug-in of your own: a complete project, tested and ready to publish.",
    )
    yield Command(
        "schema",
        "benchbot.plugins.authoring.schema_command:schema",
        "Print the JSON Schema of a declaration or document.",
    )
