"""Reports and comparisons of results."""

from collections.abc import Iterator

from benchbot.plugin import Command, TuiScreen, hookimpl


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the commands."""
    yield Command(
        "report",
        "benchbot.plugins.report.report_command:report",
        "Make a page, tables or test cases of results.",
        takes_sources=True,
    )
    yield Command(
        "compare",
        "benchbot.plugins.report.compare_command:compare",
        "Say whether one set of results scores higher than another.",
        takes_sources=True,
    )


@hookimpl
def benchbot_screens() -> Iterator[TuiScreen]:
    """Yield the screen."""
    yield TuiScreen(
        "compare",
        "benchbot.plugins.report.screen:CompareScreen",
        "Which solution is better, how sure that is, what each alone found.",
        key="C",
    )
