"""The folder of a batch: where things are in it, and making it ready for a plan.

The folder is the truth: driver and workers can die at any moment.

plan.json             the plan (schema `plan`), written first
solutions/HASH/       the snapshot of the solution that is run (see bundles/snapshot.py)
episodes/LABEL-KEY8/  result.json (there: done), log.txt, recordings, attempts.jsonl, attempt-N/ (what failed)
claims/KEY            the worker that computes an episode
events/WORKER.jsonl   the events, a file per worker
workers/WORKER.log    the output of a worker's process
crew.json             the worker pool: which executor, how many workers, what each needs
executor.json         which workers run, for later drivers
cancelled             there: the driver has to end all workers
driver.lock           held by the driver; driver.log is the output of a detached one
conclusion.json       of a detached batch: the files that were made at its end, or why there are none
results/, scores.json, report.html, junit.xml, results.zip    made of the results at the end
results/NAME/, scores/NAME/, comparison.json    the same of several solutions, and their comparison
costs.json            wall time, processor time and GPU hours of each solution
"""

import os
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.attempts import RESULT, Attempts, Finished
from benchbot.plugins.batch.plan import KEY_DIGITS, Plan, PlannedEpisode
from benchbot.plugins.bundles import snapshot as snapshots

_SHOWN = 8


class Folder:
    """The paths in a batch's folder."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.plan = path / "plan.json"
        self.claims = path / "claims"
        self.events = path / "events"
        self.workers = path / "workers"
        self.episodes = path / "episodes"
        self.solutions = path / snapshots.FOLDER
        self.worker_pool = path / "crew.json"
        self.executor = path / "executor.json"
        self.cancelled = path / "cancelled"
        self.driver_lock = path / "driver.lock"
        self.driver_log = path / "driver.log"
        self.conclusion = path / "conclusion.json"
        self._finished: dict[Path, tuple[object, Finished]] = {}

    def episode(self, name: str) -> Path:
        """Return the folder of one episode."""
        return self.episodes / name

    def attempts(self, episode: PlannedEpisode) -> Attempts:
        """Return the attempts at one episode."""
        return Attempts(self.episode(episode.name))

    def finished(self, episode: PlannedEpisode) -> Finished | None:
        """Return the record of an episode's result, as `Attempts.finished`; it is read again only when it changes."""
        attempts = self.attempts(episode)
        try:
            found = attempts.result.stat()
        except OSError:
            return None
        known = self._finished.get(attempts.result)
        # The change time as well: whoever edits a file can set its modification time back.
        stamp = found.st_ino, found.st_mtime_ns, found.st_ctime_ns, found.st_size
        if known is not None and known[0] == stamp:
            return known[1]
        finished = attempts.finished()
        if finished is not None:
            self._finished[attempts.result] = stamp, finished
        return finished

    def result(self, name: str) -> Path:
        """Return the result of one episode: where it is, the episode is done."""
        return self.episode(name) / RESULT


@dataclass(frozen=True)
class Preview:
    """The state of a folder under a plan: episodes that are done or left, and those dropped from the plan before."""

    plan: Plan
    done: tuple[PlannedEpisode, ...]
    left: tuple[PlannedEpisode, ...]
    dropped: tuple[PlannedEpisode, ...]
    before: Plan | None

    @property
    def is_changed(self) -> bool:
        """Whether the folder holds the plan of another batch."""
        return self.before is not None and self.before.hash != self.plan.hash

    @property
    def lines(self) -> list[str]:
        """The episodes that are done and left, in words."""
        robots, environments = len(self.plan.robots), len(self.plan.environments)
        counts = f"{_count(robots, 'robot')}, {_count(environments, 'environment')}"
        lines = [
            f"{_count(len(self.plan.episodes), 'episode')} ({counts}): {len(self.done)} done, {len(self.left)} to do"
        ]
        if self.dropped:
            lines.append(
                f"{_count(len(self.dropped), 'episode')} of the plan before are in it no more; they stay where they are"
            )
        return lines


def preview(folder: Folder, plan: Plan) -> Preview:
    """Compare a plan with a folder; changes nothing."""
    before = plans.read(folder.plan) if folder.plan.exists() else None
    keys = {episode.key for episode in plan.episodes}
    done: list[PlannedEpisode] = []
    left: list[PlannedEpisode] = []
    for episode in plan.episodes:
        is_done = before is not None and folder.finished(episode) is not None
        (done if is_done else left).append(episode)
    dropped = () if before is None else tuple(episode for episode in before.episodes if episode.key not in keys)
    return Preview(_with_history(plan, before, seen=bool(done)), tuple(done), tuple(left), dropped, before)


def _with_history(plan: Plan, before: Plan | None, *, seen: bool) -> Plan:
    """Return a plan that knows from which sizes it grew: such that statistics can say that its size was not fixed."""
    if before is None or before.task != plan.task:
        return plan
    if before.hash == plan.hash:
        return replace(plan, grown_from=before.grown_from)
    is_grown = {episode.key for episode in before.episodes} < {episode.key for episode in plan.episodes}
    added = (len(before.episodes),) if seen else ()
    return replace(plan, grown_from=(*before.grown_from, *added)) if is_grown else plan


def prepare(folder: Folder, plan: Plan, *, update: bool = False, keep: Callable[[], object] = lambda: None) -> Preview:
    """Write the plan into its folder, after `keep` has put there what it is about; return what is to be done.

    Raises BenchbotError for a folder with other things in it, and for one with another plan, unless it is to `update`:
    then what is not computed anew stays as it is, and the plan before is kept beside.
    """
    found = preview(folder, plan)
    if found.before is None and folder.path.is_dir() and any(folder.path.iterdir()):
        raise BenchbotError(
            f"{folder.path} is not the folder of a batch.",
            "It has something in it, but no plan.json.",
            "Name another folder, or an empty one: --output-location FOLDER",
        )
    if found.before is not None and found.is_changed and not update:
        raise BenchbotError(
            _other_title(folder, plan, found.before),
            _difference(found, found.before),
            f"Go on with that one, and with its solution as it was: benchbot batch attach {folder.path}\n"
            "Compute this one in a folder of its own: --output-location FOLDER\n"
            "Go on here with what has changed: --update; what is another's stays beside, and counts for nothing.",
        )
    check_writable(folder.path)
    keep()
    if found.before is not None and found.is_changed:
        folder.plan.replace(folder.path / f"plan-{found.before.hash[:KEY_DIGITS]}.json")
    if found.before != found.plan:
        plans.write(folder.plan, found.plan)
    return found


def first_line(folder: Folder, plan: Plan, edited: Sequence[str] = ()) -> str:
    """Return the batch, its folder and its solution, and in the same line all that is not as it seems.

    `edited` are files of the solution that have changed since.
    """
    own = plan.snapshots
    others = sorted(path.name for path in folder.solutions.glob("?" * 64) if path.name not in own)
    said = [f"Batch {plan.hash[:KEY_DIGITS]} in {folder.path}, {_solutions(plan)}"]
    if others:
        named = ", ".join(name[:KEY_DIGITS] for name in others)
        said.append(f"results of other contents of the solution lie here as well, and count for nothing: {named}")
    before = [] if folder.episodes.exists() else _of_other_content(folder, plan)
    if before:
        said.append(f"another content of the solution was computed in {', '.join(before[:_SHOWN])}")
    if edited:
        said.append(f"its files have changed since ({', '.join(edited[:_SHOWN])}), and it runs what they were")
    return "; ".join(said)


def _of_other_content(folder: Folder, plan: Plan) -> list[str]:
    """Return the folders beside that are called as this one is by default, and hold the same of another solution."""
    stem = folder.path.name.removesuffix(plan.hash[:KEY_DIGITS])
    if stem == folder.path.name:
        return []
    found = []
    for path in sorted(folder.path.parent.glob(f"{stem}{'?' * KEY_DIGITS}/plan.json")):
        with suppress(BenchbotError):
            before = plans.read(path)
            if _commands(plan) == _commands(before) and plan.snapshots != before.snapshots:
                found.append(path.parent.name)
    return found


def check_writable(folder: Path) -> None:
    """Raise BenchbotError when nothing can be written to a folder that a batch needs; makes it if it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK | os.X_OK):
            raise PermissionError(13, "Permission denied")
    except OSError as error:
        raise BenchbotError(
            f"The batch cannot use the folder {folder}.",
            f"{error.strerror}.",
            "Name one that you may write to, and that all workers can reach: --output-location FOLDER",
        ) from error


def _other_title(folder: Folder, plan: Plan, before: Plan) -> str:
    if plan.snapshots == before.snapshots:
        return f"{folder.path} holds another batch."
    return f"{folder.path} holds a batch of {_solutions(before)}, and what is given now is {_solutions(plan)}."


def _solutions(plan: Plan) -> str:
    named = [f"{name or ''} {one.snapshot[:KEY_DIGITS]}".strip() for name, one in plan.all_solutions.items()]
    return ("solution " if len(named) == 1 else "solutions ") + ", ".join(named)


def _commands(plan: Plan) -> list[object]:
    return [(name, one.native, one.example, one.words, one.hold) for name, one in plan.all_solutions.items()]


def _difference(found: Preview, before: Plan) -> str:
    """Return what has changed, and what it would cost, in words."""
    plan = found.plan
    old = {episode.key for episode in before.episodes}
    one, other = plan.solution, before.solution
    reasons = []
    for solution, alone in plan.each().items():
        now, then = alone.solution.files, before.solutions.get(solution or "", before.solution).files
        changed = (name for name in {*now, *then} if now.get(name) != then.get(name))
        reasons += [f"the file {name} of the solution{f' {solution}' if solution else ''}" for name in sorted(changed)]
    reasons += [
        f"{what}: {getattr(before, what)} before, {getattr(plan, what)} now"
        for what in ("task", "limits", "timeout_s")
        if getattr(plan, what) != getattr(before, what)
    ]
    if (one.native, one.example, one.words) != (other.native, other.example, other.words):
        reasons.append("the command of the solution")
    if set(plan.solutions) != set(before.solutions):
        reasons.append("the names of the solutions")
    if one.hold != other.hold:
        reasons.append("what holds the solution")
    fresh = [episode for episode in plan.episodes if episode.key not in old]
    if not reasons and Counter(episode.label for episode in fresh) & Counter(e.label for e in found.dropped):
        reasons.append("BenchBot, a plug-in, or an environment")
    lines = [f"Changed: {'; '.join(reasons)}."] if reasons else []
    lines.append(
        f"{len(found.done)} of {_count(len(plan.episodes), 'episode')} would stay, {len(found.left)} would be computed:"
    )
    lines += [f"  {episode.name}" for episode in found.left[:_SHOWN]]
    if len(found.left) > _SHOWN:
        lines.append(f"  … and {len(found.left) - _SHOWN} more")
    return "\n".join(lines)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
