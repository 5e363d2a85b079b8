"""Replay: takes the recorded actions of a result again, and compares the observations with those of the result."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from benchbot.core import results
from benchbot.core.budget import Spent, overrun
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.digest import MARK_DIGITS
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.host import Host
from benchbot.core.request import Limits
from benchbot.core.selection import Selection
from benchbot.core.session import Session
from benchbot.plugins.bundles.comparing import (
    SoftwareDifference,
    action_text,
    other_device,
    reselect,
    software_differences,
)

_TIME_DIGITS = 9
"""Simulated time in seconds is rounded like that in provenance."""
SEEN = "Something else is seen, first at"


@dataclass(frozen=True)
class Verification:
    """The outcome of a replay: verified when there are no `problems`, of which the first in the run is first.

    `unproven` are statements of the result that a replay cannot show; `software` differs from that of the result.
    """

    problems: tuple[str, ...]
    observations: int
    unproven: tuple[str, ...] = ()
    software: tuple[SoftwareDifference, ...] = ()

    @property
    def verified(self) -> bool:
        """Whether everything that a replay can show is as the result says."""
        return not self.problems


def verify(
    document: Mapping[str, Any],
    catalog: Catalog,
    start_host: Callable[[Selection], Host],
    tell: Callable[[int, int], object] = lambda done, of: None,
) -> Verification:
    """Replay a result's actions on a new host, within the limits that the result states.

    `tell` is called with the number of observations made and their total. Raises BenchbotError for a result that
    cannot be replayed, and when the simulator fails.
    """
    provenance = document.get("provenance") or {}
    scenes = _action_log(document, provenance)
    selection = reselect(provenance, catalog, _limits_of_last_attempt(document))
    software = tuple(software_differences(provenance, selection))
    total = sum(len(scene["rows"]) for scene in scenes)
    session = Session(selection, lambda: start_host(selection))
    try:
        problem = _replay_actions(session, scenes, lambda done: tell(done, total))
        _check_device(provenance, session, problem)
        problems = [problem] if problem else _problems(document, session)
        problems += filter(None, [overrun(document)])
        return Verification(tuple(problems), session.progress.frames, tuple(_unproven(provenance)), software)
    finally:
        session.close()


def _check_device(provenance: Mapping[str, Any], session: Session, problem: str | None) -> None:
    """Raise BenchbotError when something else is seen, and it is seen by another device than that of the result."""
    device = other_device(provenance, {"machine": session.machine})
    if device is not None and problem is not None and problem.startswith(SEEN):
        raise BenchbotError(
            "The result cannot be verified on this machine.",
            f"{problem} {device}",
            f"Verify it where there is the same device: {provenance['machine']['device']}.",
        )


def _action_log(document: Mapping[str, Any], provenance: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the action log by scene; raises BenchbotError for a result without a complete one."""
    scenes: list[dict[str, Any]] | None = document.get("actions")
    if not provenance:
        why = "It says nothing of what made it: it is of BenchBot v2, or of another program."
    elif "actions" not in document:
        why = "It holds no log of its actions: it is of an older BenchBot."
    elif scenes is None:
        why = "Its run observed too often for its actions to be logged."
    elif provenance.get("frames") != sum(len(scene["rows"]) for scene in scenes):
        why = "Its log of actions is not that of all its observations: the back end died, or somebody has changed it."
    else:
        return scenes
    raise BenchbotError(
        "The result cannot be verified.", why, "Run the solution again with this BenchBot, and verify the new result."
    )


def _limits_of_last_attempt(document: Mapping[str, Any]) -> Limits:
    """Return what the attempts before have left of the stated limits; real time passes otherwise in a replay."""
    provenance, spent = document["provenance"], Spent.of(document)
    stated = provenance["selection"].get("limits") or {}
    left = {
        name: max(0, stated[name] - (getattr(spent, name) - provenance[name]))
        for name in ("steps", "simulated_time_s")
        if name in stated
    }
    return Limits(**left)


def budgets_in_words(document: Mapping[str, Any]) -> str:
    """Return what a result says that its episode has spent: `41 of 100 steps, 2 restarts`."""
    spent, stated = Spent.of(document), document["provenance"]["selection"].get("limits") or {}
    said = []
    for name in ("steps", "restarts"):
        limit = f" of {stated[name]}" if name in stated else ""
        said.append(f"{getattr(spent, name)}{limit} {name}")
    return ", ".join(said)


def _replay_actions(session: Session, scenes: list[dict[str, Any]], tell: Callable[[int], object]) -> str | None:
    """Take all actions; return a description of the first difference in an observation, or None."""
    for number, scene in enumerate(scenes):
        for place, (mark, *taken) in enumerate(scene["rows"]):
            at = f"observation {session.progress.frames} ({scene['scene']}, {_described(place, taken)})"
            try:
                if not _act(session, number, place, taken):
                    return f"There is no scene for {at}."
            except BenchbotError as error:
                if error.failure is FailureClass.PLATFORM:
                    raise
                return f"What the log says cannot be done, at {at}: {error.title} {error.why}"
            if session.digest.hexdigest()[:MARK_DIGITS] != mark:
                return f"{SEEN} {at}."
            tell(session.progress.frames)
    return None


def _act(session: Session, scene: int, place: int, taken: list[Any]) -> bool:
    if taken:
        session.step(str(taken[0]), taken[1] if len(taken) > 1 else {})
        return place > 0
    if place > 0:
        session.step(None)
    elif scene > 0:
        return session.next_scene() is not None
    else:
        session.reset()
    return True


def _described(place: int, taken: list[Any]) -> str:
    if not taken:
        return "a look" if place else "on entering"
    return f"after {action_text(taken)}"


def _problems(document: Mapping[str, Any], session: Session) -> list[str]:
    """Return a problem for each statement of the result that contradicts the replay."""
    stated, progress = document["provenance"], session.progress
    details = results.empty_result(session.selection)
    named = {"task_details": "The task", "environment_details": "The environment"}
    problems = [
        f"{name} is not the one that is declared here." for key, name in named.items() if document[key] != details[key]
    ]
    collided = progress.failure is FailureClass.COLLISION
    claims_collision = (stated["failure"] or {}).get("class") == FailureClass.COLLISION
    compared: dict[str, tuple[Any, Any]] = {
        "its digest of the observations": (stated["observation_digest"], session.digest.hexdigest()),
        "where the robot went (track)": (document.get("track"), results.tracks(session)),
        "its simulated time": (stated["simulated_time_s"], round(progress.simulated_time_s, _TIME_DIGITS)),
    }
    problems += [f"The result is wrong about {name}." for name, (told, found) in compared.items() if told != found]
    # An action that the simulator did not survive counts as a step, but nothing was observed after it.
    if stated["steps"] - progress.steps not in (0, int(stated["failure"] is not None)):
        problems.append("The result is wrong about the number of its steps.")
    if collided and stated["failure"] is None:
        problems.append("The robot hits something, and the result does not say so.")
    if claims_collision and not collided:
        problems.append("The result says that the robot hit something, and it does not.")
    return problems


def _unproven(provenance: Mapping[str, Any]) -> list[str]:
    failure, restarts = provenance["failure"], provenance.get("restarts", 0)
    unproven = [f"what the robot did before it was put back ({restarts} restarts)"] if restarts else []
    if failure is not None and failure["class"] != FailureClass.COLLISION:
        unproven.append(f"why the episode failed ({failure['class']})")
    return unproven
