"""Recorded frames: where those of a result lie, which observation each is of, and the depth that was kept with it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchbot.core.geometry import Pose
from benchbot.core.recording import RecordingNote

FRAMES, DEPTH = "frames", ".depth.png"
TOO_FAR_MM = 65535
"""In a depth picture, of what is farther than can be said; 0 is what was not measured."""


@dataclass(frozen=True)
class Frame:
    """A recorded picture: its file, the scene, the pose of the robot's base in the map frame, the observation."""

    path: Path
    scene: int
    base: Pose
    number: int = 0

    def depth_m(self) -> NDArray[np.float64] | None:
        """Return what was recorded of depth, along the optical axis: NaN where not measured; None without any.

        Its pixel (i, j) is the picture's (i * n + n // 2, j * n + n // 2), n times as large as it is.
        """
        from PIL import Image

        try:
            millimetres = np.asarray(Image.open(self.path.with_name(self.path.stem + DEPTH)), np.float64)
        except (OSError, ValueError, SyntaxError):
            return None
        millimetres[millimetres == 0] = np.nan
        millimetres[millimetres >= TOO_FAR_MM] = np.inf
        return millimetres / 1000.0 if millimetres.ndim == 2 else None


def frame_folders(result: Path) -> list[Path]:
    """Return where the frames of a result may be; the last of them, if no other result lies in the same folder."""
    parent, stem = result.parent, result.stem
    return [parent / f"{stem}-recordings" / FRAMES, result.with_suffix(f".{FRAMES}"), parent / FRAMES]


def numbered_frames(folder: Path) -> dict[int, Path]:
    """Return the frames in a folder in order, by the number of their observation, from 0."""
    paths = sorted(folder.glob("*.jpg")) if folder.is_dir() else []
    if all(path.stem.isdecimal() for path in paths):
        return {int(path.stem): path for path in paths}
    return dict(enumerate(paths))


def frames_at(poses: Sequence[tuple[int, Pose]], folders: Sequence[Path]) -> list[Frame]:
    """Return the frames of a run that observed at these poses, each with its scene, from the first folder with them.

    There must be as many as there were observations, but for those that the recording says were dropped.
    """
    for folder in folders:
        paths = numbered_frames(folder)
        note = RecordingNote.read(folder)
        missing = 0 if note is None else note.dropped
        if paths and len(paths) + missing == len(poses) and max(paths) < len(poses):
            return [Frame(path, *poses[number], number) for number, path in paths.items()]
    return []


def folders_of(source: str | None, *, alone: bool) -> list[Path]:
    """Return where what was recorded beside a result may be; `alone` says that no other result lies in its folder."""
    # A result in an archive is named `archive:member`, which is no file.
    if source is None or not Path(source).is_file():
        return []
    folders = frame_folders(Path(source))
    return folders if alone else folders[:-1]
