"""Files of requirements: a distribution on each line, comments, and lines that go on after a backslash."""

import re
from pathlib import Path

from benchbot.core.errors import BenchbotError


def read(path: Path) -> list[str]:
    """Return the lines of a file that ask for something; raises BenchbotError for one that cannot be read.

    Options of pip on lines of their own are refused: say them to the command instead.
    """
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is no text"
        raise BenchbotError(f"{path} cannot be read.", f"{reason}.", "Name a file of requirements.") from error
    lines = [re.sub(r"(^|\s)#.*", "", line).strip() for line in re.sub(r"\\\r?\n", " ", text).splitlines()]
    for line in lines:
        if line.startswith("-"):
            raise BenchbotError(
                f"{path} holds an option, '{line}'.",
                "A line names a distribution, a folder, a repository or a wheel.",
                "Give options on the command line: benchbot install -r FILE --index-url …",
            )
    return [" ".join(line.split()) for line in lines if line]
