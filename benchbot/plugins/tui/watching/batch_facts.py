"""What is known of a batch, in words."""

from benchbot.plugins.batch.status_lines import duration
from benchbot.plugins.tui.watching.run_facts import Badge, Row
from benchbot.plugins.watching.views import BatchView, EpisodeCell, WorkerRow


def badge(view: BatchView) -> Badge:
    """Return what a batch does just now."""
    status = view.status
    if status is None:
        return Badge("READING", "muted")
    if status.is_complete:
        return Badge("COMPLETE", "success")
    if status.paused:
        return Badge("PAUSED", "warning")
    if view.problem:
        return Badge("OUT OF TOUCH", "error")
    return Badge("RUNNING", "success") if view.alive else Badge("NOBODY WORKS", "warning")


def title(view: BatchView) -> str:
    """Return which batch it is."""
    return str(view.folder)


def numbers(view: BatchView) -> list[Row]:
    """Return how far the batch is, how fast it gets on, and when it will be done."""
    status = view.status
    if status is None:
        return [("Episodes", "not known yet")]
    rows = [("Finished", f"{status.finished} of {status.episodes}")]
    rows.append(("Running", f"{len(status.running)} on {_workers(status.workers)}"))
    if status.retried:
        rows.append(("Tried again", str(status.retried)))
    if status.mean_s is not None:
        rate = "" if status.rate_per_hour is None else f", {status.rate_per_hour:.3g} per hour"
        rows.append(("An episode", f"{duration(status.mean_s)}{rate}"))
    if not status.is_complete:
        rows.append(("Left", "not known yet" if status.left_s is None else duration(status.left_s)))
    return rows


def compact(view: BatchView) -> str:
    """Return the same in one line."""
    status = view.status
    if status is None:
        return "nothing is known yet"
    parts = [f"{status.finished} of {status.episodes} finished"]
    if not status.is_complete and status.left_s is not None:
        parts.append(f"{duration(status.left_s)} left")
    idle = f", {len(status.idle)} idle" if status.idle and not status.is_complete else ""
    parts.append(f"{len(status.running)} run on {_workers(status.workers)}{idle}")
    parts += [f"{status.rate_per_hour:.3g} per hour"] if status.rate_per_hour is not None else []
    parts += [f"{status.retried} tried again"] if status.retried else []
    return " · ".join(parts)


def score(view: BatchView) -> str:
    """Return the score so far with its interval, in words."""
    found = None if view.status is None else view.status.score
    if found is None:
        return "no score yet"
    interval = "" if found.low is None or found.high is None else f" [{found.low:.3f}, {found.high:.3f}]"
    return f"{found.name} {found.value:.3f}{interval} of {found.results} results"


def worker(row: WorkerRow) -> str:
    """Return what a worker does."""
    since = "" if row.since_s is None else f" {duration(row.since_s)}"
    return f"{row.name}: idle{since}" if row.episode is None else f"{row.name}:{since} {row.episode}"


def cell(cell_: EpisodeCell) -> str:
    """Return what is known of an episode, in one line."""
    what = f"{cell_.environment} · {cell_.robot} · seed {cell_.seed}" + (
        f" · repeat {cell_.repeat}" if cell_.repeat else ""
    )
    where = "" if cell_.worker is None else f" on {cell_.worker}"
    since = "" if cell_.since_s is None else f" for {duration(cell_.since_s)}"
    return f"{cell_.state}{where}{since}: {what}"


def _workers(count: int) -> str:
    if count < 0:
        return "workers that cannot be counted from here"
    return f"{count} worker" + "s" * (count != 1)
