"""What the exit codes of every command mean, and the classes of failure."""

import re

from benchbot.cli.app import EPILOGUE
from benchbot.core.errors import ExitCode, FailureClass
from docs.tools.reference.tables import GENERATED, code, plain, table

_FAILURES = {
    FailureClass.AGENT: "the solution's: it crashed, saved no result, or asked for what it may not",
    FailureClass.COLLISION: "the robot touched something",
    FailureClass.TIMEOUT: "a limit of steps or time was used up, or the solution was ended for taking too long",
    FailureClass.PLATFORM: "the simulator or the robot died, hung, or was stopped for safety",
    FailureClass.INFRASTRUCTURE: "the machine's: the supervisor died, the disk is full, a worker of a batch was lost",
}


def page() -> str:
    """Return the page of exit codes and failure classes."""
    said = {int(number): meaning for number, meaning in re.findall(r"^ +(\d+) +(.+)$", EPILOGUE, re.MULTILINE)}
    rows = [[code(str(number.value)), code(number.name), plain(said[number.value])] for number in ExitCode]
    failures = [[code(item.value), plain(_FAILURES[item])] for item in FailureClass]
    return (
        GENERATED
        + "# Exit codes and failures\n\nEvery command ends with one of these. More of each is in "
        + "[the command line](../cli.md#exit-codes).\n\n"
        + table(["exit code", "name", "meaning"], rows)
        + "\n## Classes of failure\n\nWhose fault it is that an episode did not end well. A result keeps "
        + "its class, and so do scores and reports.\n\n"
        + table(["class", "meaning"], failures)
    )
