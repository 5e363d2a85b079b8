"""The Ray options of a work order, and their checks."""

import json
import math
import os
from collections.abc import Callable
from typing import TypeVar

from benchbot.plugin import BenchbotError, WorkOrder, did_you_mean

T = TypeVar("T")
KNOWN = ("address", "environment", "num_cpus", "num_gpus", "resources")
ALWAYS = ("PATH", "PYTHONPATH", "VIRTUAL_ENV")
"""Variables that workers get from the driver, besides those that begin with BENCHBOT_; all others are the node's."""


def check(order: WorkOrder) -> None:
    """Raise BenchbotError for an option that there is not."""
    for name in order.options:
        if name not in KNOWN:
            raise BenchbotError(
                f"Ray's executor has no option {name}.",
                f"It knows {', '.join(KNOWN)}.{did_you_mean(name, list(KNOWN))}",
                "Correct --executor-option.",
            )


def address(order: WorkOrder) -> str:
    """Return where the cluster is: the option, RAY_ADDRESS, or the one on this machine."""
    return order.options.get("address") or os.environ.get("RAY_ADDRESS") or "auto"


def resources(order: WorkOrder) -> dict[str, float]:
    """Return what a worker needs by Ray's names; raises BenchbotError for amounts that are none."""
    needs = order.resources
    asked = {"CPU": float(needs.cpus), "GPU": float(needs.gpus), "memory": float(needs.memory_bytes or 0)}
    for name, key in (("num_cpus", "CPU"), ("num_gpus", "GPU")):
        if name in order.options:
            asked[key] = _parsed(name, order.options[name], float, "a number, such as 0.25")
    if "resources" in order.options:
        asked |= _parsed("resources", order.options["resources"], _amounts, 'a JSON object, such as {"sim": 1}')
    for name, amount in asked.items():
        if not (math.isfinite(amount) and amount >= 0):
            raise BenchbotError(
                f"A worker cannot need {amount:g} of {name}.", "It is no amount.", "Correct --executor-option."
            )
    return {name: amount for name, amount in asked.items() if amount}


def environment(order: WorkOrder) -> dict[str, str]:
    """Return the variables that workers get from the driver's environment; the option names more, with commas."""
    more = order.options.get("environment", "").split(",")
    names = {*ALWAYS, *(name for name in more if name), *(name for name in os.environ if name.startswith("BENCHBOT_"))}
    return {name: os.environ[name] for name in sorted(names) if name in os.environ}


def _amounts(text: str) -> dict[str, float]:
    return {str(name): float(amount) for name, amount in dict(json.loads(text)).items()}


def _parsed(name: str, text: str, parse: Callable[[str], T], what: str) -> T:
    try:
        return parse(text)
    except (ValueError, TypeError) as error:
        raise BenchbotError(
            f"--executor-option {name}={text} cannot be understood.", f"It is not {what}.", "Correct it."
        ) from error
