# ruff: noqa: SIM112
"""The attempts of a solution that cheats: what it is after, the register of its attacks, and how they are thwarted.

What it is after comes as JSON in base 64, in its first argument or in the variable `args`. With `harmless` it takes
nothing and breaks nothing: it only looks whether it could.
"""

import base64
import errno
import json
import os
import sys
from collections.abc import Callable, Iterator

TARGETS = json.loads(base64.b64decode(sys.argv[1] if len(sys.argv) > 1 else os.environ["args"]))
HARMLESS = TARGETS["harmless"]
ATTACKS: dict[str, Callable[[], str]] = {}
Attack = Callable[[], str]


class ThwartedError(Exception):
    """The attack got nothing, and this is why."""


def attack(name: str, *, harms: bool = False) -> Callable[[Attack], Attack]:
    """Register an attack, which returns what it got, or raises OSError or ThwartedError.

    One that `harms`, or is of use only to what is held, is not tried where nothing is to be harmed.
    """

    def register(function: Attack) -> Attack:
        if not (harms and HARMLESS):
            ATTACKS[name] = function
        return function

    return register


def any_of(attempts: Iterator[Callable[[], str]]) -> str:
    """Return what the first attempt that succeeds got; raises ThwartedError with the kinds of refusals."""
    refusals = set()
    for attempt in attempts:
        try:
            return attempt()
        except ThwartedError as error:
            refusals.add(str(error))
        except OSError as error:
            refusals.add(errno.errorcode.get(error.errno or 0, type(error).__name__))
    raise ThwartedError(", ".join(sorted(refusals)) or "nothing to try")


def writable(path: str) -> str:
    """Return the path if it can be opened for writing; nothing is written."""
    os.close(os.open(path, os.O_WRONLY | os.O_APPEND))
    return path
