"""Making the folder of a batch ready: a fresh one, one to go on with, or one whose plan has changed."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.attempts import Attempts
from benchbot.plugins.batch.events import check_writable
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import Plan, PlannedEpisode

_SHOWN = 8


@dataclass(frozen=True)
class Preview:
    """What a plan means in a folder: which episodes have their result already, and which of an older plan fall out."""

    plan: Plan
    done: tuple[PlannedEpisode, ...]
    left: tuple[PlannedEpisode, ...]
    dropped: tuple[PlannedEpisode, ...]
    is_new: bool
    is_changed: bool

    @property
    def text(self) -> str:
        """What is to be computed, in words."""
        robots, environments = len(self.plan.robots), len(self.plan.environments)
        counts = f"{_count(robots, 'robot')}, {_count(environments, 'environment')}"
        lines = [
            f"{_count(len(self.plan.episodes), 'episode')} ({counts}): {len(self.done)} done, {len(self.left)} to do"
        ]
        if self.dropped:
            lines.append(
                f"{_count(len(self.dropped), 'episode')} of the plan before are in it no more; they stay where they are"
            )
        return "\n".join(lines)


def default_folder(plan: Plan, prefix: str = "batch") -> Path:
    """Return the folder of a batch that was given none: the same command finds it again."""
    return Path(f"{prefix}-{plan.hash[: plans.KEY_DIGITS]}")


def preview(folder: Folder, plan: Plan) -> Preview:
    """Look at what is in a folder already; changes nothing."""
    before = plans.read(folder.plan) if folder.plan.exists() else None
    keys = {episode.key for episode in plan.episodes}
    done = {
        episode.key
        for episode in plan.episodes
        if before is not None and Attempts(folder.episode(episode.name)).finished() is not None
    }
    return Preview(
        plan,
        tuple(episode for episode in plan.episodes if episode.key in done),
        tuple(episode for episode in plan.episodes if episode.key not in done),
        () if before is None else tuple(episode for episode in before.episodes if episode.key not in keys),
        is_new=before is None,
        is_changed=before is not None and before.hash != plan.hash,
    )


def prepare(folder: Folder, plan: Plan, *, update: bool = False) -> Preview:
    """Write the plan into its folder; return what is to be done.

    Raises BenchbotError for a folder with other things in it, and for one with another plan, unless it is to `update`:
    then what is not computed anew stays as it is, and the plan before is kept beside.
    """
    found = preview(folder, plan)
    if found.is_new and folder.path.is_dir() and any(folder.path.iterdir()):
        raise BenchbotError(
            f"{folder.path} is not the folder of a batch.",
            "It has something in it, but no plan.json.",
            "Name another folder, or an empty one: --output-location FOLDER",
        )
    if found.is_changed and not update:
        raise BenchbotError(
            f"{folder.path} holds another batch.",
            _difference(found, plans.read(folder.plan)),
            "Give --update to go on here with what has changed, or choose another folder with --output-location.",
        )
    check_writable(folder.path)
    if found.is_changed:
        before = plans.read(folder.plan)
        folder.plan.replace(folder.path / f"plan-{before.hash[: plans.KEY_DIGITS]}.json")
    plans.write(folder.plan, plan)
    return found


def _difference(found: Preview, before: Plan) -> str:
    """Say what has changed, and what it would cost."""
    plan = found.plan
    old = {episode.key for episode in before.episodes}
    one, other = plan.solution, before.solution
    changed = (name for name in {*one.files, *other.files} if one.files.get(name) != other.files.get(name))
    reasons = [f"the file {name} of the solution" for name in sorted(changed)]
    reasons += [
        f"{what}: {getattr(before, what)} before, {getattr(plan, what)} now"
        for what in ("task", "limits", "timeout_s")
        if getattr(plan, what) != getattr(before, what)
    ]
    if (one.native, one.example, one.words) != (other.native, other.example, other.words):
        reasons.append("the command of the solution")
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
