"""Where the robot was: the track that was recorded of it, or the poses that it was to visit."""

from collections.abc import Sequence
from dataclasses import dataclass

from benchbot.core.geometry import Pose
from benchbot.plugins.drawing.episodes import Document, Episode

FOLLOW = "move_next"
FARTHEST_M = 1e5
"""Coordinates beyond this are no place of a robot."""


@dataclass(frozen=True)
class Way:
    """The way through one scene: points in the map frame (x, y in metres), and the base's pose at each observation.

    `recorded` says whether the robot was there, or was only meant to be.
    """

    points: tuple[tuple[float, float], ...]
    observed: tuple[Pose, ...]
    recorded: bool
    path_length_m: float | None = None
    collisions: int | None = None


def ways(episode: Episode) -> list[Way]:
    """Return the way through each scene of an episode."""
    tracks = (episode.document or {}).get("track") or []
    if tracks:
        return [_recorded(track) for track in tracks]
    actions = (episode.document or {}).get("task_details", {}).get("actions", [FOLLOW])
    return [_planned(scene, follows=FOLLOW in actions) for scene in episode.scenes]


def _recorded(track: Document) -> Way:
    columns: Sequence[str] = track["columns"]
    x, y, yaw = (columns.index(name) for name in ("x_m", "y_m", "yaw_rad"))
    number = columns.index("observation")
    rows = [row for row in track["rows"] if max(abs(row[x]), abs(row[y])) < FARTHEST_M]
    return Way(
        points=tuple((float(row[x]), float(row[y])) for row in rows),
        observed=tuple(Pose.planar(row[x], row[y], row[yaw]) for row in rows if row[number] is not None),
        recorded=True,
        path_length_m=track.get("path_length_m"),
        collisions=track.get("collisions"),
    )


def _planned(scene: Document, *, follows: bool) -> Way:
    if "start_pose" not in scene:
        return Way((), (), recorded=False)
    declared = [scene["start_pose"], *(scene.get("trajectory_poses", ()) if follows else ())]
    poses = tuple(map(Pose.from_wxyz_xyz, declared))
    return Way(tuple((pose.translation_xyz[0], pose.translation_xyz[1]) for pose in poses), poses, recorded=False)
