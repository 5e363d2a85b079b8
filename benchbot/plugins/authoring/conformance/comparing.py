"""A simulator in the golden room and in the scene that was given: does it show, and stop at, what stands there?"""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import Platform, Scene
from benchbot.core.plugin_manager import load
from benchbot.evaluation import occupancy_map
from benchbot.evaluation.ground_truths import GroundTruths
from benchbot.plugins.authoring.comparability import across, checks, golden_room, motion
from benchbot.plugins.authoring.comparability.senses import Sight
from benchbot.plugins.authoring.comparability.world import World
from benchbot.plugins.authoring.conformance.bench import SEED, Bench, Declared, drive, rest
from benchbot.plugins.authoring.conformance.properties import obtain

SENSES = ("image_rgb", "image_depth", "image_segment", "laser", "lidar", "imu")
LOOKS, TURN_RADPS, TURN_S = 5, 0.8, 1.5
WALL_AWAY_M, FASTEST_MPS = 5.0, 1.0
OBJECTS = "object_map_ground_truth"


def check_comparability(
    bench: Bench, platform: Platform, environment: Declared, broken: Sequence[Finding]
) -> list[Finding]:
    """Return findings on whether results in this simulator can be compared with those in others.

    `broken` are findings so far: a channel whose values have a wrong form is not looked at again.
    """
    malformed = {one.subject.removeprefix("observe: ") for one in broken if one.level is Level.BROKEN}
    channels = [name for name in bench.channels if name not in malformed]
    return [
        *_found("golden room", lambda: _in_the_golden_room(bench, platform, channels)),
        *_found("scene", lambda: list(_in_the_scene(bench, platform, channels, environment))),
    ]


def _found(place: str, check: Callable[[], list[Finding]]) -> list[Finding]:
    """Return the findings of a check, each named after its place; that of what the platform raised where it did."""
    finding, made = obtain(place, check, lambda found: f"{len(found)} properties")
    return [replace(one, subject=f"{place}: {one.subject}") for found in made for one in found] or [finding]


def _in_the_golden_room(bench: Bench, platform: Platform, channels: Sequence[str]) -> list[Finding]:
    declared = bench.scene.environment
    if "map_path" not in declared:
        return [_not_loaded("its environment names no scene, no map_path")]
    with tempfile.TemporaryDirectory(prefix="benchbot-golden-room-") as folder:
        scenes = [golden_room.scene(Path(folder), start, declared) for start in golden_room.STARTS]
        try:
            platform.load(scenes[0], SEED)
        # Any error at all may come of a scene that a simulator with worlds of its own does not expect.
        except Exception as error:  # noqa: BLE001
            said = (
                f"{error.title} {error.why}" if isinstance(error, BenchbotError) else f"{type(error).__name__}: {error}"
            )
            return [_not_loaded(said)]
        sights = look_around(platform, scenes, channels)
        found = checks.check_senses(sights, bench.spec.robot)
        found.append(
            drive_at_the_wall(bench, platform, golden_room.scene(Path(folder), golden_room.WALL_START, declared))
        )
        return found


def _not_loaded(why: str) -> Finding:
    return Finding(
        Level.WARNING,
        "load",
        f"Not checked: the simulator does not load a plain scene ({why}), so nothing says that it shows what is there.",
        "Load the GLB file that map_path names (docs/scenes.md); a simulator with worlds of its own may not.",
    )


def look_around(platform: Platform, scenes: Sequence[Scene], channels: Sequence[str]) -> list[Sight]:
    """Return what a robot observes at the start of each scene and, turning on the spot, all around."""
    sights = []
    for number, scene in enumerate(scenes):
        platform.load(scene, SEED)
        for _ in range(LOOKS if number == 0 else 2):
            # Observations are copied by nobody: that they are left alone is a property of its own.
            sights.append(Sight(dict(platform.observe(channels)), platform.pose(), number))
            drive(platform, 0.0, TURN_RADPS, TURN_S)
    return sights


def drive_at_the_wall(bench: Bench, platform: Platform, scene: Scene) -> Finding:
    """Return the finding on a robot that drives at a wall of the golden room."""
    robot: Mapping[str, Any] = bench.spec.robot
    speed_mps = min(MotionConfig.from_robot(robot, "ground_truth").linear_limits_mps[1], FASTEST_MPS)
    platform.load(scene, SEED)
    way: list[Pose] = [platform.pose()]
    while not platform.collided and platform.clock() < WALL_AWAY_M / speed_mps:
        platform.drive(speed_mps, 0.0, platform.control_period_s)
        way.append(platform.pose())
    collided = platform.collided
    rest(platform)
    return motion.check_contact(way, collided, float(robot["footprint"]["radius_m"]), golden_room.ROOM)


def _in_the_scene(
    bench: Bench, platform: Platform, channels: Sequence[str], environment: Declared
) -> Iterator[Finding]:
    robot = bench.spec.robot
    sights = look_around(platform, [bench.scene], [name for name in channels if name != "image_rgb"])
    # Ground truths are those of what is installed, which takes long to read where it was not read already.
    if isinstance(environment, str) and {"image_depth", "image_segment"} <= set(channels):
        truths = GroundTruths.of(Catalog(load()), None)
        try:
            truth = truths.find(environment, (OBJECTS,))
        except BenchbotError:
            pass
        else:
            yield from across.check_boxes(sights, robot, World.of_ground_truth(truth["ground_truth"]))
    yield from across.check_laser(sights, robot)
    floor = occupancy_map.map_file(bench.scene.environment, bench.scene.folder)
    # A file that is no map of ROS is not for this: `check_environment` reads what environments name.
    with suppress(BenchbotError):
        yield from across.check_map(sights, robot, occupancy_map.read(floor))
