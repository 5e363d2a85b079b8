"""Follow a run or a batch without screens: as plain lines, one rewritten line, JSON lines, or not at all."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict

from benchbot.cli.kit.status_line import Display, StatusLine, progress_text
from benchbot.plugins.batch import status_lines
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import BatchView, LogLine, RunView

PERIOD_S = 0.1
_MIB = 2**20
_PRINTED_LEVELS = ("warning", "error")


def follow(feed: RunFeed | BatchFeed, display: Display = "auto") -> None:
    """Show the views of a feed on stderr until its run or batch has ended.

    KeyboardInterrupt, which the caller handles, leaves the run or batch running.
    """
    with StatusLine(display) as line:
        if isinstance(feed, RunFeed):
            _follow_run(feed, line)
        else:
            _follow_batch(feed, line)


def _follow_run(feed: RunFeed, line: StatusLine) -> None:
    shown: Sequence[LogLine] = ()
    read = 0
    while True:
        view = feed.view
        if view.log is not shown:
            shown = view.log
            for entry in [entry for entry in view.log if entry.number >= read]:
                # The supervisor's own lines about each step are in the status.
                if entry.source == "solution" or entry.level in _PRINTED_LEVELS:
                    line.note(f"{entry.source} {entry.level}: {entry.text}", {"kind": "log", **asdict(entry)})
            read = view.log_dropped + len(view.log)
        if not view.alive:
            break
        _show_run(view, line)
        time.sleep(PERIOD_S)
    line.note(f"{view.problem or 'The run has ended.'}{'' if view.result is None else f' Result: {view.result}'}")


def _show_run(view: RunView, line: StatusLine) -> None:
    progress = view.progress
    urgent = bool(progress and (progress["waiting_for"] or progress["ends_run"]))
    news = tuple(progress.get(key) for key in ("state", "frames", "failure", "waiting_for")) if progress else ()
    news = (*news, view.problem, view.paused, view.held, view.driven_by_hand)
    line.show(_run_text(view), news, urgent=urgent, document=lambda: _run_document(view))


def _run_text(view: RunView) -> str:
    """Return everything that is known of a run in one line, except its log and observations."""
    if not view.progress:
        return view.problem or "nothing known yet"
    parts = [progress_text(view.progress, view.session.get("scene_count", 1)), *_last_action(view), *_limits(view)]
    if view.driven_by_hand:
        parts.append(f"{view.driven_by_hand} by hand")
    if view.usage is not None:
        parts.append(f"{view.usage.cpu_percent:.0f} % CPU · {view.usage.memory_bytes / _MIB:.0f} MiB")
    if view.problem is not None:
        parts.append(view.problem)
    return " · ".join(parts)


def _last_action(view: RunView) -> Iterator[str]:
    last = view.last
    if last is None:
        return
    values = ", ".join(f"{value:g}" for value in last["arguments"].values() if isinstance(value, int | float))
    yield f"{last['action']}({values}): {last['outcome'] or 'under way'}{' by hand' if last['by_hand'] else ''}"


def _limits(view: RunView) -> Iterator[str]:
    """Yield the rest of each limit."""
    limits = view.session.get("selection", {}).get("limits", {})
    units = {"steps": "steps", "simulated_time_s": "s simulated", "wall_time_s": "s", "restarts": "restarts"}
    for name, unit in units.items():
        limit = limits.get(name)
        if limit is not None:
            yield f"{max(0, limit - view.progress['spent'][name]):.0f} {unit} left"


def _run_document(view: RunView) -> dict[str, object]:
    return {
        "kind": "progress",
        "scene_count": view.session.get("scene_count"),
        **view.progress,
        "held": view.held,
        "driven_by_hand": view.driven_by_hand,
        "last": view.last,
        "frames_per_s_now": round(view.frames_per_s, 3),
        "real_time_factor_now": round(view.real_time_factor, 3),
        "usage": None if view.usage is None else asdict(view.usage),
        "problem": view.problem,
    }


def _follow_batch(feed: BatchFeed, line: StatusLine) -> None:
    while True:
        view = feed.view
        if view.status is not None:
            status_lines.show(line, view.status)
            if view.status.is_complete or not view.alive:
                break
        elif view.problem is not None:
            line.show(view.problem, view.problem)
        time.sleep(PERIOD_S)
    for text in _batch_end(view):
        line.note(text)


def _batch_end(view: BatchView) -> list[str]:
    if view.status is None:
        return [view.problem or "Nothing is known of it."]
    *verdict, last = status_lines.verdict(view.status)
    if not view.status.is_complete:
        return [*verdict, f"{last} Nobody works at the rest. Go on with: benchbot batch attach {view.folder}"]
    score = view.status.score
    return [*verdict, last if score is None else f"{last} {score.name} {score.value:.3f}"]
