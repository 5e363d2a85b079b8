"""Properties of seeds: the same one gives the same bytes, another one changes only what is stochastic."""

from typing import Any

from benchbot.core.geometry import Pose
from benchbot.core.platform import ManyCameras, Platform
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, drive
from benchbot.plugins.authoring.conformance.properties import Wrong
from benchbot.plugins.authoring.conformance.seeing import digest

EXACT = ("image_rgb_info", "image_depth_info", "image_segment_info")
Run = tuple[list[str], list[Pose]]


def repeats_itself(bench: Bench, platform: Platform) -> str:
    """The same seed gives the same bytes: again on the same platform, and on a fresh one."""
    first = _run(bench, platform, SEED)
    _same(bench, first, _run(bench, platform, SEED), "on the same platform")
    with bench.fresh() as another:
        _same(bench, first, _run(bench, another, SEED), "on a fresh platform")
    return "the same bytes on the same platform and on a fresh one"


def seeds_change_nothing_else(bench: Bench, platform: Platform) -> str:
    """Where the robot starts, and what its sensors are, is the same for every seed."""
    platform.load(bench.scene, SEED)
    start, seen = platform.pose(), platform.observe(bench.channels)
    platform.load(bench.scene, SEED + 1)
    if platform.pose() != start:
        raise Wrong("The start pose depends on the seed.", "Start where the scene says, whatever the seed.")
    other = platform.observe(bench.channels)
    for name in bench.channels:
        if _form(seen[name]) != _form(other[name]):
            raise Wrong(f"Shapes or types of {name} depend on the seed.", "Draw noise from the seed, nothing else.")
        if name in EXACT and digest({name: seen[name]}) != digest({name: other[name]}):
            raise Wrong(f"{name} depends on the seed.", "Draw noise from the seed, nothing else.")
    return "start pose, shapes and camera models are those of every seed"


def twins_see_the_same(bench: Bench, platform: Platform) -> str:
    """Many that look at once see, to the byte, what each would see alone."""
    if not isinstance(platform, ManyCameras):
        return "one robot at a time"
    platform.load(bench.scene, SEED)
    twin: Any = platform.twin()
    twin.load(bench.scene, SEED + 1)
    together = platform.observe_many([platform, twin], bench.channels)
    platform.load(bench.scene, SEED)
    twin.load(bench.scene, SEED + 1)
    alone = [each.observe(bench.channels) for each in (platform, twin)]
    twin.close()
    if [digest(seen) for seen in together] != [digest(seen) for seen in alone]:
        raise Wrong("observe_many differs from observe.", "Give each twin the bytes that it would observe alone.")
    return "two at once, to the byte"


def _run(bench: Bench, platform: Platform, seed: int) -> Run:
    platform.load(bench.scene, seed)
    seen, poses = [], []
    for angular_radps in (0.4, -0.2):
        drive(platform, 0.05, angular_radps, 0.3)
        seen.append(digest(platform.observe(bench.channels)))
        poses.append(platform.odometry())
    return seen, poses


def _same(bench: Bench, first: Run, second: Run, where: str) -> None:
    if first[1] != second[1]:
        raise Wrong(
            f"The same seed gives another odometry {where}.",
            "Draw all noise from a generator that load() makes of its seed.",
        )
    if first[0] == second[0]:
        return
    raise Wrong(
        f"The same seed gives other observations {where}.",
        "Draw all noise from a generator that load() makes of its seed.",
    )


def _form(value: Any) -> Any:
    """Return everything about a value but its numbers."""
    if isinstance(value, dict):
        return {key: _form(entry) for key, entry in value.items()}
    return (str(value.dtype), value.shape) if hasattr(value, "dtype") else type(value).__name__
