"""Where a run or a batch stands, in one line for people."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchbot.plugins.watching.views import RunView

_MIB = 2**20


def progress_text(progress: Mapping[str, Any], scene_count: int) -> str:
    """Return one line that says where an episode stands; `progress` is as the supervisor tells it (docs/wire.md)."""
    if progress["waiting_for"]:
        return f"WAITING FOR YOU: {_one_line(progress['waiting_for'])} When it is done, type elsewhere: benchbot ready"
    if progress["ends_run"]:
        return f"STOPPED FOR SAFETY, the run is over: {_one_line(progress['failure_why'])}"
    if not progress["frames"]:
        return "PAUSED · nothing observed yet" if progress["paused"] else "nothing observed yet"
    steps = f"step {progress['steps']}"
    if progress["trajectory_index"]:
        steps += f" · pose {progress['trajectory_index']}/{progress['trajectory_length']}"
    wall_s = progress["wall_time_s"]
    frames_per_s = progress["frames"] / wall_s if wall_s > 0 else 0.0
    parts = [
        *(["PAUSED"] if progress["paused"] else ()),
        progress["state"],
        f"scene {progress['scene_number'] + 1}/{scene_count}",
        steps,
        *_place(progress["pose_xyyaw"]),
        f"{progress['simulated_time_s']:.1f} s simulated",
        f"{wall_s:.1f} s",
        f"{frames_per_s:.1f} frames/s",
    ]
    if progress["failure"]:
        parts.append(f"failure: {progress['failure']}")
    return " · ".join(parts)


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


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _place(pose_xyyaw: Sequence[float] | None) -> Iterator[str]:
    if pose_xyyaw is not None:  # a task with noisy localisation hides it
        x, y, yaw_rad = pose_xyyaw
        yield f"at ({x:.2f}, {y:.2f}) m {math.degrees(yaw_rad):.0f}°"
