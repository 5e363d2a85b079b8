"""The status of a run in words, short enough for a narrow terminal."""

import math
from collections.abc import Mapping
from typing import Any

from textual.content import Content

from benchbot.plugins.tui import panels
from benchbot.plugins.tui.panels import Badge, Gauge, Row, Trend
from benchbot.plugins.watching.views import RunView

MIB, GIB = 2**20, 2**30
NAMES_WIDTH = 9
LIMITS = (
    ("Steps", "steps", ""),
    ("Simulated", "simulated_time_s", "s"),
    ("Wall", "wall_time_s", "s"),
    ("Restarts", "restarts", ""),
)
"""The title, key and unit of each limit."""


def badge(view: RunView, *, by_hand: bool = False) -> Badge:
    """Return the state of a run in a word; `by_hand` says that its watcher drives."""
    progress = view.progress
    if not view.alive:
        failure = progress.get("failure")
        return Badge(f"ENDED: {failure}", "error") if failure else Badge("ENDED", "muted")
    if progress.get("waiting_for"):
        return Badge("WAITS FOR YOU", "warning")
    if view.problem and view.session:
        return Badge("OUT OF TOUCH", "error")
    if progress.get("ends_run"):
        return Badge("STOPPED FOR SAFETY", "error")
    if by_hand:
        return Badge("DRIVEN BY HAND", "accent")
    if view.paused:
        return Badge("PAUSED" if view.held else "PAUSES AT THE NEXT STEP", "warning")
    if not view.session:
        return Badge("CONNECTING", "muted")
    if progress.get("failure"):
        return Badge(f"FAILED: {progress['failure']}", "error")
    if not view.session.get("started", True) and not progress.get("frames"):
        return Badge("NO SOLUTION YET", "muted")
    return Badge("RUNNING", "success")


def title(view: RunView) -> str:
    """Return environment, robot, seed and task."""
    state = view.state
    return f"{state.environment} · {state.robot} · seed {state.seed} · {state.task}"


def where(view: RunView) -> list[Row]:
    """Return state, step, pose and heading."""
    progress = view.progress
    if not progress:
        return [("State", "nothing is known yet")]
    state = str(progress["state"])
    if progress.get("failure"):
        state += f" ({progress['failure']})"
    scene = f"scene {progress['scene_number'] + 1}/{view.session.get('scene_count', 1)}"
    rows = [("State", state), ("Step", f"{progress['steps']}, {scene}")]
    if progress.get("trajectory_length") and progress.get("trajectory_index"):
        rows.append(("Pose", f"{progress['trajectory_index']} of {progress['trajectory_length']}"))
    pose = progress.get("pose_xyyaw")
    if pose is not None:
        rows.append(("At", f"({pose[0]:.2f}, {pose[1]:.2f}) m {math.degrees(pose[2]):.0f}°"))
    if view.driven_by_hand:
        rows.append(("By hand", f"{view.driven_by_hand} steps"))
    return rows


def last_step(last: Mapping[str, Any] | None) -> str:
    """Return the newest action with its outcome and result."""
    if not last:
        return "nothing yet"
    arguments = ", ".join(f"{name}={_argument(value)}" for name, value in dict(last.get("arguments") or {}).items())
    action = f"{last.get('action')}({arguments})" + (" by hand" if last.get("by_hand") else "")
    came = [str(last[key]) for key in ("outcome", "result") if last.get(key) is not None]
    return f"{action} → {', '.join(came)}" if came else f"{action}, under way"


def trends(view: RunView, score: str = "") -> list[Trend]:
    """Return times, rates, load, coverage and score, as far as they are known, with what they have been lately."""
    progress, usage, history = view.progress, view.usage, view.history
    found = []
    if progress:
        # A task that hides where the robot is hides its time, too.
        robot_s = progress.get(_time_key(view))
        if robot_s is not None:
            found.append(Trend(_robot_time(view), f"{duration(robot_s)} ({view.real_time_factor:.2f}×)", ()))
        found.append(Trend("Wall", duration(progress["wall_time_s"]), ()))
        values = [each.frames_per_s for each in history]
        found.append(Trend("Frames/s", f"{view.frames_per_s:.1f} ({progress['frames']})", values))
    if usage is not None:
        found.append(Trend("CPU", f"{usage.cpu_percent:.0f} %", [each.cpu_percent for each in history]))
        found.append(Trend("Memory", memory(usage.memory_bytes), [each.memory_bytes for each in history]))
        if usage.gpu_percent is not None or usage.gpu_memory_bytes is not None:
            share = "" if usage.gpu_percent is None else f"{usage.gpu_percent:.0f} %"
            held = "" if usage.gpu_memory_bytes is None else memory(usage.gpu_memory_bytes)
            found.append(Trend("GPU", ", ".join(filter(None, [share, held])), ()))
    if progress and progress.get("trajectory_length"):
        share = progress["trajectory_index"] / progress["trajectory_length"]
        found.append(Trend("Coverage", f"{100 * share:.0f} %", [each.coverage for each in history]))
    return [*found, Trend("Score", score, ())] if score else found


def _time_key(view: RunView) -> str:
    return "simulated_time_s" if "simulated_time_s" in view.progress else "robot_time_s"


def _robot_time(view: RunView) -> str:
    return "Simulated" if _time_key(view) == "simulated_time_s" else "Robot"


def gauges(view: RunView) -> list[Gauge]:
    """Return the used share of each limit that the run has."""
    progress = view.progress
    if not progress:
        return []
    limits, spent = dict(view.session.get("selection", {}).get("limits") or {}), progress["spent"]
    return [
        Gauge(name, float(spent[key]), float(limits[key]), unit)
        for name, key, unit in LIMITS
        if limits.get(key) and spent.get(key) is not None
    ]


def columns(view: RunView, score: str, width: int) -> dict[str, Content]:
    """Return what stands side by side in so many cells each: where the run is, and what it has used lately."""
    said = panels.rows([*where(view), ("Last", last_step(view.last))], NAMES_WIDTH)
    return {
        "where": Content("\n").join(filter(None, [said, panels.bars(gauges(view), width, NAMES_WIDTH)])),
        "use": panels.trends(trends(view, score), width),
    }


def brief(view: RunView, score: str) -> Content:
    """Return the same in few lines, with bars of the first limits."""
    bars = Content("  ").join(
        Content.assemble((f"{each.name} ", panels.MUTED), panels.bar(each.share, 8), f" {each}")
        for each in gauges(view)[:3]
    )
    lines = [*map(Content, compact(view)), Content.assemble(bars, f"  {score}" if score else "")]
    return Content("\n").join(filter(None, lines))


def compact(view: RunView) -> list[str]:
    """Return the same in few lines, without limits."""
    facts = dict(where(view))
    progress = view.progress
    if not progress:
        return [facts["State"]]
    parts = [facts["State"], f"step {facts['Step']}"]
    parts += [f"pose {facts['Pose'].replace(' of ', '/')}"] if "Pose" in facts else []
    parts += [f"at {facts['At']}"] if "At" in facts else []
    parts += [f"{facts['By hand']} by hand"] if "By hand" in facts else []
    used = {each.name: each.now for each in trends(view)}
    machine = " · ".join(f"{name} {used[name]}" for name in ("CPU", "Memory", "GPU") if name in used)
    robot = used.get(_robot_time(view))
    clock = f"{robot} in {used['Wall']}" if robot else used["Wall"]
    rates = " · ".join(filter(None, [clock, f"{view.frames_per_s:.1f} frames/s", machine]))
    return [" · ".join(parts), f"Last: {last_step(view.last)}", rates]


def problem(view: RunView) -> str:
    """Return the most urgent problem in words, or the end of the run; empty while all is well."""
    if not view.alive:
        parts = ["The run has ended."] if view.progress.get("failure_why") or view.result is not None else []
        if view.progress.get("failure_why"):
            parts.append(str(view.progress["failure_why"]))
        if view.result is not None:
            parts.append(f"Its result is in {view.result}.")
        return " ".join(parts) or view.problem or "The run has ended."
    if view.problem:
        return f"{view.problem} What is shown may be old." if view.session else view.problem
    return str(view.progress.get("failure_why") or "")


def is_bad(view: RunView) -> bool:
    """Return whether the problem is an error: the end of a run is none, nor a first answer that is still missing."""
    return bool(view.progress.get("failure")) or (view.alive and bool(view.problem) and bool(view.session))


def follows_trajectory(view: RunView) -> bool:
    """Return whether the trajectory has a next pose."""
    progress = view.progress
    return bool(progress.get("trajectory_length")) and progress["trajectory_index"] < progress["trajectory_length"]


def duration(seconds: float) -> str:
    """Return a time: `12.3 s`, `4:05 min`, `2:01:09 h`."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02} h" if hours else f"{minutes}:{rest:02} min"


def memory(size_bytes: float) -> str:
    """Return an amount of memory."""
    return f"{size_bytes / GIB:.1f} GiB" if size_bytes >= GIB else f"{size_bytes / MIB:.0f} MiB"


def _argument(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
