"""Budgets: what an episode has spent over all its attempts, resets included, and whether its limits allow that."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Self

from benchbot.core.request import Limits

LIMITED = {"steps": "steps", "simulated_time_s": "seconds of simulated time", "wall_time_s": "seconds of wall time"}
"""The limits that are used up bit by bit, and their units."""


@dataclass(frozen=True)
class Spent:
    """The use of an episode's budgets. An attempt lasts until the robot is put back after it has moved, a `restart`.

    `looks` are observations without an action. Lengths in metres, times in seconds; `simulated_time_s` is by the
    robot's clock, of a real robot too.
    """

    steps: int = 0
    looks: int = 0
    restarts: int = 0
    collisions: int = 0
    path_length_m: float = 0.0
    simulated_time_s: float = 0.0
    wall_time_s: float = 0.0

    def __add__(self, other: "Spent") -> "Spent":
        return Spent(*(getattr(self, one.name) + getattr(other, one.name) for one in fields(self)))

    def used_up(self, limits: Limits, *names: str) -> str | None:
        """Return in a sentence which of the limits of these names is used up; None for none."""
        for name in names:
            limit = getattr(limits, name)
            if limit is not None and getattr(self, name) >= limit:
                return f"The limit of {limit:g} {LIMITED[name]} is used up."
        return None

    def repeatable(self, time_key: str = "simulated_time_s") -> dict[str, float]:
        """Return what of it is the same in each run with one seed, as plain data; the robot's time by its key."""
        kept = {name: round(value, 9) for name, value in asdict(self).items() if name != "wall_time_s"}
        time_s = kept.pop("simulated_time_s")
        return {**kept, time_key: time_s}

    @classmethod
    def of(cls, result: Mapping[str, Any]) -> Self:
        """Return what the whole episode of a result document has spent, as far as it says; wall time it never says.

        Of an older result with restarts, that is what the last attempt has spent.
        """
        provenance, tracks = result.get("provenance") or {}, result.get("track") or ()
        last = {name: provenance[name] for name in ("steps", "restarts", "simulated_time_s") if name in provenance}
        last |= {name: sum(track[name] for track in tracks) for name in ("collisions", "path_length_m")}
        rows = [row for scene in result.get("actions") or () for row in scene["rows"][1:]]
        told = {"looks": sum(len(row) == 1 for row in rows), **last, **provenance.get("spent", {})}
        time_s = told.pop("robot_time_s", provenance.get("robot_time_s"))
        return cls(**({} if time_s is None else {"simulated_time_s": time_s}) | told)


def overrun(result: Mapping[str, Any]) -> str | None:
    """Return in a sentence how the episode of a result has spent more than its limits allow; None if it has not.

    An action that is under way is not cut off: simulated time may end beyond its limit.
    """
    limits = ((result.get("provenance") or {}).get("selection") or {}).get("limits") or {}
    for name in ("steps", "restarts"):
        used, limit = getattr(Spent.of(result), name), limits.get(name)
        if limit is not None and used > limit:
            return f"It has taken {used} {name}, and its limit is {limit}."
    return None
