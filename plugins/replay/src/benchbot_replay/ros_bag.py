"""ROS 2 bags as recordings: one instant of a bag is one step."""

import math
import shutil
from hashlib import sha256
from itertools import chain
from json import dumps, loads
from pathlib import Path
from typing import Any, cast

from benchbot.plugin import (
    ActionResult,
    BenchbotError,
    Pose,
    Progress,
    State,
    Step,
    cache_dir,
    misfits,
    public_environment,
    wrap_angle_rad,
    write_text,
)
from benchbot_record_mcap.recording import McapRecording
from benchbot_replay.bag import Bag
from benchbot_replay.bag_instants import Findings, Instant, instants

NOTES = "notes.json"
"""A file beside a recording that was made of a bag: what there is to know of it."""
AWAY_M, TURNED_DEG = 0.2, 10.0
"""How far from the environment's start a bag may begin without a word."""


def converted(bag: Bag) -> tuple[Path, list[str]]:
    """Return the folder of a recording made of a bag, in BenchBot's cache, and in sentences what is odd about it.

    It is made once of the same. Raises BenchbotError for a bag that cannot be read, and for one without what the task
    observes.
    """
    _require_fit(bag)
    said = [one.data for one in (bag.robot, bag.task, bag.environment)]
    content = bag.content_sha256()
    key = sha256(dumps([content, said, bag.every_s], sort_keys=True).encode()).hexdigest()[:32]
    folder = cache_dir() / "replay" / "bags" / key
    if not folder.is_dir():
        part = folder.with_suffix(".part")
        shutil.rmtree(part, ignore_errors=True)
        write_text(part / NOTES, dumps(convert(bag, part / "mcap", content)))
        part.rename(folder)
    return folder / "mcap", loads((folder / NOTES).read_text("utf-8"))


def convert(bag: Bag, folder: Path, content_sha256: str) -> list[str]:
    """Write a recording of a bag into a folder, and return in sentences what is odd about it.

    Raises BenchbotError as `converted` does.
    """
    findings = Findings()
    found = instants(bag, findings)
    first = next(found, None)
    if first is None:
        raise bag.refused(
            "No messages of all that the task observes were taken at one time, with the robot's pose known.",
            "See whether its stamps fit together (driver.timing.sync_tolerance_s), and whether its poses cover them.",
        )
    # What comes compressed with loss is known from the first of each.
    run = _run(bag, content_sha256, sorted(findings.lossy))
    recording, progress, before = McapRecording(folder), Progress(), None
    recording.run(run)
    for instant in chain([first], found):
        _write(recording, progress, instant, first.stamp_ns, before)
        before = instant.base
        if instant.collided:
            break
    recording.close()
    return _odd(bag, first, findings)


def _odd(bag: Bag, first: Instant, findings: Findings) -> list[str]:
    start = Pose.from_wxyz_xyz(bag.environment.data["start_pose"])
    away_m = math.dist(start.translation_xyz[:2], first.base.translation_xyz[:2])
    turned_deg = abs(math.degrees(wrap_angle_rad(first.base.yaw_rad - start.yaw_rad)))
    said = []
    if findings.without_pose:
        said.append(f"{findings.without_pose} instants are left out: where the robot was then is not known.")
    if away_m > AWAY_M or turned_deg > TURNED_DEG:
        said.append(
            f"It begins {away_m:.2f} m and {turned_deg:.0f}° away from the start of {bag.environment.name}: "
            "if its map frame is another one, scores are wrong."
        )
    return said


def _write(recording: McapRecording, progress: Progress, instant: Instant, first_ns: int, before: Pose | None) -> None:
    action = None if before is None else "move_next"
    x, y, _ = instant.base.translation_xyz
    progress.frames += 1
    progress.simulated_time_s = (instant.stamp_ns - first_ns) / 1e9
    progress.pose_xyyaw = (x, y, instant.base.yaw_rad)
    progress.state = State.COLLIDED if instant.collided else State.DIRTY if action else State.CLEAN
    if before is not None:
        progress.steps += 1
        progress.trajectory_index += 1
        progress.last_action = action
        progress.path_length_m += math.dist(before.translation_xyz[:2], (x, y))
    result = ActionResult.COLLISION if instant.collided else ActionResult.SUCCESS
    outcome = cast(Any, None if action is None else "collided" if instant.collided else "reached")
    recording.step(
        action, {}, Step(cast(Any, instant.observations), result, ("move_next",), progress.state, 0, outcome), progress
    )


def _run(bag: Bag, content_sha256: str, lossy: list[str]) -> dict[str, Any]:
    """Return the run as solutions of it would have been told of it."""
    environment = bag.environment.name
    return {
        "task": bag.task.data,
        "robot": bag.robot.data,
        "environments": [public_environment(bag.environment)],
        "selection": {"task": bag.task.name, "robot": bag.robot.name, "environment": environment, "settings": {}},
        "bag": {"sha256": content_sha256, "every_s": bag.every_s, "lossy": lossy},
    }


def _require_fit(bag: Bag) -> None:
    for error in misfits(bag.robot.data, bag.environment):
        raise error
    if bag.task.data.get("scene_count", 1) != 1 or list(bag.task.data["actions"]) != ["move_next"]:
        raise BenchbotError(
            f"The task '{bag.task.name}' cannot be run on a bag.",
            "A bag is of one scene, and its robot went where it went: what it would have seen elsewhere is not there.",
            "Choose a passive task of one scene: its only action is move_next.",
        )
