"""Reading the result that a solution left: with suspicion, since whoever wrote it may want to mislead its reader."""

import json
import os
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.submission.init.handover import open_result
from benchbot.submission.modes import RESULT_MAX_BYTES

MAX_DEPTH = 100


def read(path: Path) -> dict[str, Any]:
    """Return a solution's result, one JSON object.

    Raises BenchbotError (failure `agent`) when there is none, and for anything but a regular file, one that is larger
    than `RESULT_MAX_BYTES`, something that is not JSON, and lists and objects in more than `MAX_DEPTH` others.
    """
    try:
        handle = open_result(str(path), RESULT_MAX_BYTES)
    except FileNotFoundError as error:
        raise BenchbotError(
            "The solution saved no result.",
            "It ended well, but wrote nothing where BENCHBOT_RESULT says.",
            "Save one: in Agent.save_result, or in a loop of your own, to BenchBot.result_filename.",
            failure=FailureClass.AGENT,
        ) from error
    except OSError as error:
        raise _unreadable(f"{error.strerror or error}.") from error
    with os.fdopen(handle, "rb") as file:
        data = file.read(RESULT_MAX_BYTES + 1)
    if len(data) > RESULT_MAX_BYTES:
        raise _unreadable(f"It has more than {RESULT_MAX_BYTES} bytes.")
    try:
        document = json.loads(data.decode("utf-8"))
    except json.JSONDecodeError as error:
        raise _unreadable(f"result:{error.lineno}: not valid JSON: {error.msg}.") from error
    except ValueError as error:
        # Not UTF-8, or an integer of more than 4300 digits (sys.set_int_max_str_digits).
        raise _unreadable(f"{error}.") from error
    except RecursionError as error:
        raise _unreadable(_TOO_DEEP) from error
    if not isinstance(document, dict):
        raise _unreadable(f"It holds a {type(document).__name__}.")
    if _is_deeper(document, MAX_DEPTH):
        raise _unreadable(_TOO_DEEP)
    return document


_TOO_DEEP = f"It has lists and objects in more than {MAX_DEPTH} others."


def _is_deeper(document: Any, limit: int) -> bool:
    level = [document]
    for _ in range(limit):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
        if not level:
            return False
    return True


def _unreadable(why: str) -> BenchbotError:
    return BenchbotError(
        "The solution's result cannot be read.",
        f"{why[0].upper()}{why[1:]}",
        "Write it with json.dump, as one JSON object.",
        failure=FailureClass.AGENT,
    )
