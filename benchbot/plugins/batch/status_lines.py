"""Where a batch stands, as people read it: a line that is rewritten, a page, and how it ended."""

from typing import TYPE_CHECKING, Any

from benchbot.plugins.batch.error_groups import lines
from benchbot.plugins.batch.status import BatchStatus

if TYPE_CHECKING:
    from benchbot.cli.kit.status_line import StatusLine


def line(status: BatchStatus) -> str:
    """Return one line."""
    parts = [f"{status.finished}/{status.episodes} episodes", *_failures(status)]
    if status.paused:
        parts.append(f"PAUSED: {status.paused}")
    parts.append(f"{len(status.running)} running on {status.workers} workers")
    if status.idle and not status.is_complete:
        parts.append(f"{len(status.idle)} idle")
    if status.rate_per_hour is not None:
        parts.append(f"{per_hour(status.rate_per_hour)}/h")
    if status.left_s is not None and not status.is_complete:
        parts.append(f"{duration(status.left_s)} left")
    return " · ".join([*parts, *_score(status)])


def show(line_: "StatusLine", status: BatchStatus) -> None:
    """Show where a batch stands, as the display of a status line says."""

    def document() -> dict[str, Any]:
        return {"kind": "batch", **status.as_dict()}

    line_.show(line(status), (status.finished, status.paused, len(status.running)), document=document)


def page(status: BatchStatus) -> list[str]:
    """Return everything that is known, in lines."""
    rows: list[tuple[str, str]] = [
        ("Folder", status.folder),
        ("Finished", f"{status.finished} of {status.episodes}"),
        ("Failures", ", ".join(_failures(status)) or "none"),
        *(("", line) for line in lines(status.errors, status.folder)),
        ("Tried again", str(status.retried)),
        ("Running", str(len(status.running))),
        *(("", f"{each.episode} on {each.worker}, {_since(each.since_s)}") for each in status.running),
        ("Pending", str(status.pending)),
        ("Workers", f"{status.workers}, {len(status.idle)} of them idle" if status.workers >= 0 else "not known"),
        *([("Paused", status.paused)] if status.paused else ()),
        ("An episode", "not known yet" if status.mean_s is None else duration(status.mean_s)),
        (
            "Left",
            "nothing" if status.is_complete else "not known yet" if status.left_s is None else duration(status.left_s),
        ),
    ]
    for name, path in ((status.conclusion or {}).get("files") or {}).items():
        rows.append((name.capitalize(), path))
    if status.conclusion is not None and "problem" in status.conclusion:
        rows.append(("Not scored", status.conclusion["problem"]))
    return [f"{label:<13}{value}".rstrip() for label, value in rows]


def verdict(status: BatchStatus) -> list[str]:
    """Return in lines how a batch ended, equal errors together."""
    said = ", ".join(_failures(status))
    told = f"{status.finished} of {status.episodes} episodes are finished" + (
        f"; {said}." if said else ", all of them well."
    )
    return [told, *lines(status.errors, status.folder)]


def duration(seconds: float) -> str:
    """Return a time as people say it: `42 s`, `3 min`, `2.5 h`."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 100 * 60 else f"{seconds / 3600:.1f} h"


def per_hour(rate: float) -> str:
    """Return a number of episodes per hour as people write it: `2.5`, `240`, `12900`."""
    return f"{rate:.{0 if rate >= 10 else 1}f}"


def _failures(status: BatchStatus) -> list[str]:
    return [f"{count} failed ({name})" for name, count in status.failures.items()]


def _score(status: BatchStatus) -> list[str]:
    score = status.score
    if score is None:
        return []
    interval = "" if score.low is None or score.high is None else f" [{score.low:.2f}, {score.high:.2f}]"
    return [f"{score.name} {score.value:.3f}{interval} of {score.results}"]


def _since(since_s: float | None) -> str:
    return "begun" if since_s is None else f"for {duration(since_s)}"
