"""The three requests that use the robot and are answered with what it observes: `reset`, `step` and `next_scene`."""

from functools import partial
from typing import Any

import msgspec

from benchbot.supervisor.platform import borrowed
from benchbot.supervisor.run import Caller, Run


class StepRequest(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a step: no action only observes."""

    action: str | None = None
    arguments: dict[str, Any] = {}


class Nothing(msgspec.Struct, forbid_unknown_fields=True):
    """The body of a request that has nothing to say."""


BODIES: dict[str, type[StepRequest | Nothing]] = {"reset": Nothing, "step": StepRequest, "next_scene": Nothing}
"""What the body of each route is read as."""


def answer(run: Run, route: str, body: StepRequest | Nothing, opened: str | None, caller: Caller) -> bytes:
    """Carry a request out and return its answer as MessagePack, for a client that has opened the arena `opened`.

    It is encoded while the memory of its arrays is lent to this request. Raises BenchbotError as `Run` does.
    """
    encode = partial(borrowed.encode, opened=opened)
    if isinstance(body, StepRequest):
        return run.step(body.action, body.arguments, caller, encode)
    return (run.reset if route == "reset" else run.next_scene)(caller, encode)
