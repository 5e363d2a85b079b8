"""Following a run or a batch without screens: plain lines, a line that is rewritten, JSON lines, or nothing."""

import time
from collections.abc import Sequence
from dataclasses import asdict

from benchbot.cli.kit.status_line import Display, StatusLine
from benchbot.plugins.batch import status_lines
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.lines import run_text
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import BatchView, LogLine, RunView

PERIOD_S = 0.1
_WORTH_A_LINE = ("warning", "error")


def follow(feed: RunFeed | BatchFeed, display: Display = "auto") -> None:
    """Show what a feed tells on stderr until what it watches has ended.

    KeyboardInterrupt, which the caller sees to, leaves it running.
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
            total = view.log_dropped + len(view.log)
            for said in view.log[max(0, len(view.log) - (total - read)) :]:
                _print(said, line)
            read = total
        if not view.alive:
            break
        _show_run(view, line)
        time.sleep(PERIOD_S)
    line.note(f"{view.problem or 'The run has ended.'}{'' if view.result is None else f' Result: {view.result}'}")


def _print(said: LogLine, line: StatusLine) -> None:
    # What the supervisor notes of each step is in the status.
    if said.source == "solution" or said.level in _WORTH_A_LINE:
        line.note(f"{said.source} {said.level}: {said.text}", {"kind": "log", **asdict(said)})


def _show_run(view: RunView, line: StatusLine) -> None:
    progress = view.progress
    urgent = bool(progress and (progress["waiting_for"] or progress["ends_run"]))
    news = tuple(progress.get(key) for key in ("state", "frames", "failure", "waiting_for")) if progress else ()
    news = (*news, view.problem, view.paused, view.held, view.driven_by_hand)
    line.show(run_text(view), news, urgent=urgent, document=lambda: _run_document(view))


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
    line.note(_batch_end(view))


def _batch_end(view: BatchView) -> str:
    if view.status is None:
        return view.problem or "Nothing is known of it."
    said = status_lines.verdict(view.status)
    if not view.status.is_complete:
        return f"{said} Nobody works at the rest. Go on with: benchbot batch attach {view.folder}"
    score = view.status.score
    return said if score is None else f"{said} {score.name} {score.value:.3f}"
