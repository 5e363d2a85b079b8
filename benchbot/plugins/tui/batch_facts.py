"""A batch in words, bars and letters: its state, numbers, score, workers, and the states of its episodes."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from textual.content import Content

from benchbot.plugins.batch.status import Score
from benchbot.plugins.batch.status_lines import duration, per_hour
from benchbot.plugins.tui.panels import Badge, Row
from benchbot.plugins.watching.views import BatchView, EpisodeCell, WorkerRow

MOST_WORKERS = 40
PENDING, RUNNING, DONE = "pending", "running", "done"


class StateStyle(NamedTuple):
    """The letter and the colours of a state of episodes."""

    letter: str
    color: str
    background: str
    bold: bool = False

    @property
    def markup(self) -> str:
        """The colours as a style of Textual's markup."""
        background = f" on {self.background}" if self.background != "transparent" else ""
        return f"{'bold ' if self.bold else ''}{self.color}{background}"


STATES = {
    DONE: StateStyle("✓", "$text-success", "$success-muted"),
    "agent": StateStyle("A", "#000000", "#e5a50a"),
    "collision": StateStyle("C", "#ffffff", "#a347ba"),
    "timeout": StateStyle("T", "#ffffff", "#865e3c"),
    "platform": StateStyle("P", "#ffffff", "#e01b24"),
    "infrastructure": StateStyle("I", "#ffffff", "#8a1020"),
    RUNNING: StateStyle("▶", "#ffffff", "#2a72cc", bold=True),
    PENDING: StateStyle("·", "$foreground 45%", "transparent"),
}
"""The known states, in the order in which they are listed."""
OTHER = StateStyle("F", "#ffffff", "#5e5c64")
"""The style of any other failure."""


def style(state: str) -> StateStyle:
    """Return the letter and the colours of a state."""
    return STATES.get(state, OTHER)


def badge(view: BatchView) -> Badge:
    """Return the state of a batch in a word."""
    status = view.status
    if status is None:
        return Badge("READING", "muted")
    failed = sum(status.failures.values())
    if status.is_complete and failed:
        said = f"✗ {failed} OF {status.episodes} FAILED"
        return Badge(said, "error") if failed == status.episodes else Badge(said, "warning")
    if status.is_complete:
        return Badge(f"✓ ALL {status.episodes} COMPLETE", "success")
    if status.paused:
        return Badge("PAUSED", "warning")
    if view.problem:
        return Badge("OUT OF TOUCH", "error")
    return Badge("RUNNING", "success") if view.alive else Badge("NOBODY WORKS", "warning")


def numbers(view: BatchView) -> list[Row]:
    """Return the progress of a batch, its pace, and the time that is left."""
    status = view.status
    if status is None:
        return [("Episodes", "not known yet")]
    failed = sum(status.failures.values())
    rows = [("Finished", f"{status.finished} of {status.episodes}")]
    rows += [("Of these", f"✓ {status.finished - failed}  ✗ {failed}")] if failed else []
    rows.append(("Running", f"{len(status.running)} on {_count(status.workers)}"))
    if status.retried:
        rows.append(("Tried again", str(status.retried)))
    if status.mean_s is not None:
        rate = "" if status.rate_per_hour is None else f", {per_hour(status.rate_per_hour)} per hour"
        rows.append(("An episode", f"{duration(status.mean_s)}{rate}"))
    if not status.is_complete:
        rows.append(("Left", "not known yet" if status.left_s is None else duration(status.left_s)))
    return rows


def compact(view: BatchView) -> str:
    """Return the same in one line."""
    status = view.status
    if status is None:
        return "nothing is known yet"
    failed = sum(status.failures.values())
    parts = [f"{status.finished} of {status.episodes} finished" + (f", ✗ {failed} failed" if failed else "")]
    if not status.is_complete and status.left_s is not None:
        parts.append(f"{duration(status.left_s)} left")
    idle = f", {len(status.idle)} idle" if status.idle and not status.is_complete else ""
    parts.append(f"{len(status.running)} run on {_count(status.workers)}{idle}")
    parts += [f"{per_hour(status.rate_per_hour)} per hour"] if status.rate_per_hour is not None else []
    parts += [f"{status.retried} tried again"] if status.retried else []
    return " · ".join(parts)


def scores(view: BatchView) -> list[str]:
    """Return the score so far of each solution with its interval, in words."""
    alone = None if view.status is None else view.status.score
    found = dict(view.scores) or ({None: alone} if alone is not None else {})
    return [_score(name, found[name]) for name in sorted(found, key=str)] or ["no score yet"]


def _score(name: str | None, found: Score) -> str:
    interval = "" if found.low is None or found.high is None else f" [{found.low:.3f}, {found.high:.3f}]"
    of = f"{name}: " if name else ""
    return f"{of}{found.name} {found.value:.3f}{interval} of {found.results} results"


def workers(view: BatchView) -> str:
    """Return a line for each worker."""
    lines = [_worker(row) for row in view.workers[:MOST_WORKERS]]
    if len(view.workers) > MOST_WORKERS:
        lines.append(f"and {len(view.workers) - MOST_WORKERS} more")
    return "\n".join(lines) or "none is known"


def episode(cell: EpisodeCell) -> str:
    """Return the state, worker and selection of an episode in one line."""
    what = f"{cell.environment} · {cell.who} · seed {cell.seed}" + (f" · repeat {cell.repeat}" if cell.repeat else "")
    what += f" · {cell.setting}" if cell.setting else ""
    what += f" · score {cell.score:.3f}" if cell.score is not None else ""
    where = "" if cell.worker is None else f" on {cell.worker}"
    since = "" if cell.since_s is None else f" for {duration(cell.since_s)}"
    return f"{cell.state}{where}{since}: {what}"


def state_bar(states: Sequence[str], width: int) -> Content:
    """Return a bar of so many columns, and the number of episodes in each state below it."""
    counted = tally(states)
    columns = shares(list(counted.values()), width)
    bar = [
        (filled(state, counted[state], share), style(state).markup)
        for state, share in zip(counted, columns, strict=True)
    ]
    return Content("\n").join([Content.assemble(*bar), _legend(counted, width)])


def failure_counts(counted: dict[str, int]) -> Content:
    """Return the number of failed episodes, a line for each class of failure."""
    if not counted:
        return Content("none")
    lines = [
        Content.assemble((f" {style(name).letter} ", style(name).markup), f" {count} {name}")
        for name, count in counted.items()
    ]
    return Content("\n").join(lines)


def tally(states: Iterable[str]) -> dict[str, int]:
    """Return the number of episodes in each state, successes first."""
    counted = Counter(states)
    known = [state for state in STATES if state in counted]
    return {state: counted[state] for state in [*known, *sorted(counted.keys() - set(known))]}


def filled(state: str, count: int, width: int) -> str:
    """Return the part of a bar for a state: its sign and number in the middle, where there is room; else the sign."""
    letter = style(state).letter
    words = f"{letter} {count}"
    if state == PENDING or len(words) + 2 > width:
        return letter * width if state == PENDING or width < 1 else letter.center(width)
    return words.center(width)


def shares(numbers: Sequence[int], width: int) -> list[int]:
    """Return how many of `width` columns stand for each number: all of them together, at least one for any but 0.

    Where there are fewer columns than that, the greatest numbers have them.
    """
    total = sum(numbers)
    present = sorted((place for place, number in enumerate(numbers) if number), key=lambda place: -numbers[place])
    found = [0] * len(numbers)
    if len(present) >= width:
        for place in present[: max(width, 0)]:
            found[place] = 1
        return found
    for place in present:
        found[place] = max(1, numbers[place] * width // total)
    while present and sum(found) > width:
        found[max(present, key=found.__getitem__)] -= 1
    rest = sorted(present, key=lambda place: found[place] - numbers[place] * width / total)
    for place in rest[: width - sum(found)]:
        found[place] += 1
    return found


def _legend(counted: dict[str, int], width: int) -> Content:
    with_words = [f"{count} {state}" for state, count in counted.items()]
    fits = sum(len(text) + 4 for text in with_words) <= width + 2
    texts = with_words if fits else [str(count) for count in counted.values()]
    parts = [
        Content.assemble((style(state).letter, style(state).markup), f" {text}")
        for state, text in zip(counted, texts, strict=True)
    ]
    return Content("  ").join(parts)


def _worker(row: WorkerRow) -> str:
    since = "" if row.since_s is None else f" {duration(row.since_s)}"
    return f"{row.name}: idle{since}" if row.episode is None else f"{row.name}:{since} {row.episode}"


def _count(count: int) -> str:
    if count < 0:
        return "workers that cannot be counted from here"
    return f"{count} worker" + "s" * (count != 1)
