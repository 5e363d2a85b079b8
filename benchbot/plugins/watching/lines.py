"""Where a run or a batch stands, in one line for people."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from benchbot.cli.kit.status_line import progress_text

if TYPE_CHECKING:
    from benchbot.plugins.watching.views import RunView

_MIB = 2**20


def run_text(view: "RunView") -> str:
    """Return one line that says all that is known of a run, but for its log and what it sees."""
    if not view.progress:
        return view.problem or "nothing known yet"
    parts = [progress_text(view.progress, view.session.get("scene_count", 1)), *_last(view), *_limits(view)]
    if view.driven_by_hand:
        parts.append(f"{view.driven_by_hand} by hand")
    if view.usage is not None:
        parts.append(f"{view.usage.cpu_percent:.0f} % CPU · {view.usage.memory_bytes / _MIB:.0f} MiB")
    if view.problem is not None:
        parts.append(view.problem)
    return " · ".join(parts)


def _last(view: "RunView") -> Iterator[str]:
    last = view.last
    if last is None:
        return
    values = ", ".join(f"{value:g}" for value in last["arguments"].values() if isinstance(value, int | float))
    yield f"{last['action']}({values}): {last['outcome'] or 'under way'}{' by hand' if last['by_hand'] else ''}"


def _limits(view: "RunView") -> Iterator[str]:
    """Yield what is left of each limit."""
    limits = view.session.get("selection", {}).get("limits", {})
    units = {"steps": "steps", "simulated_time_s": "s simulated", "wall_time_s": "s"}
    for name, unit in units.items():
        limit = limits.get(name)
        if limit is not None:
            yield f"{max(0, limit - view.progress[name]):.0f} {unit} left"
