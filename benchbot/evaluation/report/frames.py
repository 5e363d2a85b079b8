"""The frames that were recorded beside a result: which there are, and where each was taken from."""

from dataclasses import dataclass
from pathlib import Path

from benchbot.core.geometry import Pose
from benchbot.evaluation.report.driven import ways
from benchbot.evaluation.report.material import Episode, Material

FOLDER = "frames"


@dataclass(frozen=True)
class Frame:
    """A recorded picture: its file, the scene, and the pose of the robot's base in the map frame."""

    path: Path
    scene: int
    base: Pose


def frames_of(episode: Episode, material: Material) -> list[Frame]:
    """Return an episode's frames, in order; none when there are not as many as the robot made observations.

    They are looked for in `STEM.frames` beside `STEM.json`, and in `frames` when no other result of the report lies in
    the same folder.
    """
    poses = [(scene, pose) for scene, way in enumerate(ways(episode)) for pose in way.observed]
    for folder in _folders(episode, material):
        paths = sorted(folder.glob("*.jpg")) if folder.is_dir() else []
        if paths and len(paths) == len(poses):
            return [Frame(path, scene, pose) for path, (scene, pose) in zip(paths, poses, strict=True)]
    return []


def _folders(episode: Episode, material: Material) -> list[Path]:
    if material.frames is not None:
        return [material.frames]
    # A result in an archive is named `archive:member`, which is no file.
    if episode.source is None or not Path(episode.source).is_file():
        return []
    path = Path(episode.source)
    neighbours = [other for other in material.episodes if other.source and Path(other.source).parent == path.parent]
    return [path.with_suffix(f".{FOLDER}"), *([path.parent / FOLDER] if len(neighbours) == 1 else [])]
