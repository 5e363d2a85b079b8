"""The user's settings of the screens, kept in the state folder; a file that cannot be read counts as none."""

import json
from contextlib import suppress

from benchbot.core import atomic, resources
from benchbot.core.errors import BenchbotError

FILE = "screens.json"


def read() -> dict[str, str]:
    """Return the settings by name."""
    with suppress(OSError, ValueError, BenchbotError):
        document = json.loads((resources.state_dir() / FILE).read_bytes())
        if isinstance(document, dict):
            return {str(name): str(value) for name, value in document.items()}
    return {}


def write(name: str, value: str) -> None:
    """Keep a setting, or forget it where its value is empty; raises BenchbotError when it cannot be kept."""
    kept = {key: text for key, text in {**read(), name: value}.items() if text}
    path = resources.state_dir() / FILE
    try:
        atomic.write(path, json.dumps(kept, indent=1).encode())
    except OSError as error:
        raise BenchbotError(
            "The setting cannot be kept.", f"{path}: {error.strerror}.", "Free some disk space."
        ) from error
