"""While a real robot moves: signs of life to its driver, and a look at the processes without which it may not go on."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import chain
from typing import NamedTuple

from benchbot.core.errors import FailureClass
from benchbot.process import is_stopped, tree
from benchbot.wire.joining import Lease

PERIOD_S = 0.03
FROZEN = "was frozen (SIGSTOP, or Ctrl-Z) while the robot moved"


class Frozen(NamedTuple):
    """A process that is frozen: the class of the failure that this is, and a sentence."""

    failure: FailureClass
    why: str


@contextmanager
def repeated(call: Callable[[], object]) -> Iterator[None]:
    """Call something every 30 ms in a thread, for as long as the context lasts."""
    over = threading.Event()

    def repeat() -> None:
        while not over.wait(PERIOD_S):
            call()

    thread = threading.Thread(target=repeat, name="benchbot-vigil", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def frozen(starter: int | None, lease: Lease | None, asks: int | None) -> Frozen | None:
    """Return who is frozen of those that act in a run; None when nobody is.

    They are the process that has started run and solution, the one that has leased the robot, the one that asks for the
    action under way, where it is known, and all that these have started.
    """
    leased = lease.pid if lease is not None else None
    commands = (starter, leased if lease is not None and lease.by_command else None)
    for pid in chain.from_iterable(tree(root) for root in (starter, leased, asks) if root):
        if is_stopped(pid) and pid in commands:
            return Frozen(FailureClass.PLATFORM, f"The command that has started it (process {pid}) {FROZEN}.")
        if is_stopped(pid):
            return Frozen(FailureClass.AGENT, f"The solution (process {pid}) {FROZEN}.")
    return None
