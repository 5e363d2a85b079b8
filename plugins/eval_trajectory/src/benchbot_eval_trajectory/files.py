"""Trajectory files: those of the TUM RGB-D benchmark and of the KITTI odometry benchmark.

TUM: a pose a line, `time x y z qx qy qz qw`, seconds, metres, `#` begins a comment. KITTI: a pose a line, the first
three rows of its 4 x 4 matrix, no times. https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats,
A. Geiger et al., "Are we ready for Autonomous Driving? The KITTI Vision Benchmark Suite", CVPR 2012.
"""

from enum import StrEnum
from pathlib import Path

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_eval_trajectory.trajectory import Floats, Trajectory

SIZE_LIMIT_BYTES = 256 * 2**20
NORM_TOLERANCE = 0.01
"""The largest deviation from unit length of a quaternion or a rotation matrix's row; TUM's files have four decimals."""


class FileFormat(StrEnum):
    """The format of a file of poses."""

    TUM = "tum"
    KITTI = "kitti"


_COLUMNS = {8: FileFormat.TUM, 12: FileFormat.KITTI}


def read(path: Path) -> Trajectory:
    """Return the trajectory in a TUM or KITTI file, which differ in their number of columns.

    Raises BenchbotError, with the line, for what is no such file, numbers that are not finite, rotations that are none,
    and times that go back.
    """
    text = _text(path)
    lines = [(number, line.split()) for number, line in enumerate(text.splitlines(), 1)]
    lines = [(number, words) for number, words in lines if words and not words[0].startswith("#")]
    if not lines:
        raise _refused(path, None, "It has no poses.")
    width = len(lines[0][1])
    if width not in _COLUMNS:
        raise _refused(path, lines[0][0], f"It has {width} numbers; a pose has 8 (TUM) or 12 (KITTI).")
    rows = np.empty((len(lines), width))
    for row, (number, words) in zip(rows, lines, strict=True):
        if len(words) != width:
            raise _refused(path, number, f"It has {len(words)} numbers, the lines before have {width}.")
        row[:] = _numbers(path, number, words)
    numbers = np.array([number for number, _ in lines])
    return _tum(path, numbers, rows) if _COLUMNS[width] is FileFormat.TUM else _kitti(path, numbers, rows)


def text_of(trajectory: Trajectory, file_format: FileFormat) -> str:
    """Return a trajectory as the text of a file, with all digits; raises BenchbotError for TUM without times."""
    if file_format is FileFormat.KITTI:
        rows = np.concatenate([trajectory.rotations, trajectory.positions_m[:, :, None]], axis=2).reshape(-1, 12)
        return _lines(rows)
    if trajectory.times_s is None:
        raise BenchbotError(
            "These poses have no times.",
            "A TUM file says when each pose was; a KITTI file does not.",
            "Begin with a trajectory that has times.",
        )
    times = trajectory.times_s[:, None]
    return "# time_s x y z qx qy qz qw\n" + _lines(
        np.concatenate([times, trajectory.positions_m, trajectory.rotations_xyzw], axis=1)
    )


def _tum(path: Path, numbers: Floats, rows: Floats) -> Trajectory:
    times_s, positions_m, quaternions = rows[:, 0], rows[:, 1:4], rows[:, 4:]
    # Equal ones are common: the benchmark's own ground truths have some.
    late = np.flatnonzero(np.diff(times_s) < 0)
    if len(late):
        line = int(numbers[late[0] + 1])
        raise _refused(path, line, f"Its time, {times_s[late[0] + 1]!s} s, is before that of the pose before.")
    off = np.flatnonzero(np.abs(np.linalg.norm(quaternions, axis=1) - 1) > NORM_TOLERANCE)
    if len(off):
        norm = float(np.linalg.norm(quaternions[off[0]]))
        raise _refused(path, int(numbers[off[0]]), f"Its quaternion has the length {norm:.3g}, not 1.")
    return Trajectory.from_quaternions(positions_m, quaternions, times_s)


def _kitti(path: Path, numbers: Floats, rows: Floats) -> Trajectory:
    matrices = rows.reshape(-1, 3, 4)
    rotations = matrices[:, :, :3]
    products = np.einsum("nij,nkj->nik", rotations, rotations)
    skewed = np.abs(products - np.eye(3)).max(axis=(1, 2)) > 2 * NORM_TOLERANCE
    off = np.flatnonzero(skewed | (np.linalg.det(rotations) < 0))
    if len(off):
        raise _refused(path, int(numbers[off[0]]), "Columns 1-3, 5-7 and 9-11 are not the rows of a rotation matrix.")
    return Trajectory(matrices[:, :, 3], rotations)


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > SIZE_LIMIT_BYTES:
            raise _refused(path, None, f"It is larger than {SIZE_LIMIT_BYTES >> 20} MiB.")
        return path.read_text("utf-8")
    except OSError as error:
        raise _refused(path, None, f"{error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise _refused(path, None, "It is not text.") from error


def _numbers(path: Path, line: int, words: list[str]) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise _refused(path, line, f"It is not all numbers: {error}.") from error
    if not np.isfinite(numbers).all():
        raise _refused(path, line, "It has a number that is not finite.")
    return numbers


def _lines(rows: Floats) -> str:
    return "".join(" ".join(repr(value) for value in row) + "\n" for row in rows.tolist())


def _refused(path: Path, line: int | None, why: str) -> BenchbotError:
    return BenchbotError(
        f"{path} is not a trajectory.",
        why if line is None else f"Line {line}: {why}",
        "Give poses in order of time, one a line: time x y z qx qy qz qw (TUM), or 12 numbers of a matrix (KITTI).",
    )
