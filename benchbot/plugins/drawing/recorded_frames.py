"""The frames that were recorded beside a result: which there are, and where each was taken from."""

from dataclasses import dataclass
from pathlib import Path

from benchbot.core.geometry import Pose
from benchbot.core.recording import RecordingNote
from benchbot.plugins.drawing.driven import ways
from benchbot.plugins.drawing.episodes import Episode, Material

FOLDER = "frames"


@dataclass(frozen=True)
class Frame:
    """A recorded picture: its file, the scene, and the pose of the robot's base in the map frame."""

    path: Path
    scene: int
    base: Pose


def frames_of(episode: Episode, material: Material) -> list[Frame]:
    """Return an episode's frames, in order; none when there are not as many as the robot made observations.

    They are looked for in `STEM-recordings/frames` and `STEM.frames` beside `STEM.json`, and in `frames` when no other
    result of the report lies in the same folder.
    """
    poses = [(scene, pose) for scene, way in enumerate(ways(episode)) for pose in way.observed]
    for folder in _folders(episode, material):
        paths = numbered(folder)
        note = RecordingNote.read(folder)
        missing = 0 if note is None else note.dropped
        if paths and len(paths) + missing == len(poses) and max(paths) < len(poses):
            return [Frame(path, *poses[number]) for number, path in paths.items()]
    return []


def numbered(folder: Path) -> dict[int, Path]:
    """Return the frames in a folder in order, by the number of their observation, from 0."""
    paths = sorted(folder.glob("*.jpg")) if folder.is_dir() else []
    if all(path.stem.isdecimal() for path in paths):
        return {int(path.stem): path for path in paths}
    return dict(enumerate(paths))


def places(result: Path) -> list[Path]:
    """Return where the frames of a result may be; the last of them, if no other result lies in the same folder."""
    parent, stem = result.parent, result.stem
    return [parent / f"{stem}-recordings" / FOLDER, result.with_suffix(f".{FOLDER}"), parent / FOLDER]


def _folders(episode: Episode, material: Material) -> list[Path]:
    if material.frames is not None:
        return [material.frames]
    # A result in an archive is named `archive:member`, which is no file.
    if episode.source is None or not Path(episode.source).is_file():
        return []
    path = Path(episode.source)
    neighbours = [other for other in material.episodes if other.source and Path(other.source).parent == path.parent]
    beside = places(path)
    return beside if len(neighbours) == 1 else beside[:-1]
