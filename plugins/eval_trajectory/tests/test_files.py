"""TUM and KITTI files: read, written, and refused with the line that is wrong."""

import re
from pathlib import Path

import numpy as np
import pytest

from benchbot.core.errors import BenchbotError
from benchbot_eval_trajectory.files import FileFormat, read, text_of
from benchbot_eval_trajectory.trajectory import Trajectory
from plugins.eval_trajectory.tests.ways import wander

POSE = "0 0 0 0 0 0 1"


@pytest.mark.parametrize("file_format", list(FileFormat))
def test_what_is_written_is_read_again(tmp_path: Path, file_format: FileFormat) -> None:
    way = wander(50)
    (tmp_path / "way.txt").write_text(text_of(way, file_format))
    found = read(tmp_path / "way.txt")

    assert (found.positions_m == way.positions_m).all()
    assert found.rotations == pytest.approx(way.rotations, abs=1e-15)
    if file_format is FileFormat.TUM:
        assert found.times_s is not None
        assert (found.times_s == way.times_s).all()
    else:
        assert found.times_s is None


def test_comments_and_empty_lines_are_passed_over(tmp_path: Path) -> None:
    (tmp_path / "way.tum").write_text(f"# time x y z\n\n1.5 1 2 3 0 0 0.7071 0.7071\n #\n2.5 {POSE}\n")
    found = read(tmp_path / "way.tum")

    assert found.positions_m.tolist() == [[1, 2, 3], [0, 0, 0]]
    assert found.rotations[0] @ [1, 0, 0] == pytest.approx([0, 1, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "It has no poses"),
        ("# nothing\n", "It has no poses"),
        ("1 2 3\n", "Line 1: It has 3 numbers; a pose has 8"),
        (f"# time\n1 {POSE}\n1 {POSE}\n2 0 0\n", "Line 4: It has 3 numbers, the lines before have 8"),
        (f"1 {POSE}\n2 {POSE[:-1]}one\n", "Line 2: It is not all numbers: .*'one'"),
        ("1 nan 0 0 0 0 0 1\n", "Line 1: It has a number that is not finite"),
        (f"1 {POSE}\n\n0.5 {POSE}\n", "Line 3: Its time, 0.5 s, is before"),
        ("1 0 0 0 0 0 0 0.5\n", "Line 1: Its quaternion has the length 0.5"),
        ("1 0 0 0 0 2 0 0 0 0 1 0\n", "Line 1: .* not the rows of a rotation matrix"),
        ("1 0 0 0 0 1 0 0 0 0 -1 0\n", "Line 1: .* not the rows of a rotation matrix"),
    ],
)
def test_what_is_no_trajectory_is_refused(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "way.txt"
    path.write_text(text)

    with pytest.raises(BenchbotError, match="not a trajectory") as caught:
        read(path)
    assert str(path) in caught.value.title
    assert re.match(why, caught.value.why)


def test_files_that_are_not_there_or_not_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "picture.txt").write_bytes(b"\x89PNG\xff\xfe")

    for name, why in (("none.txt", "No such file"), ("picture.txt", "not text"), (".", "directory")):
        with pytest.raises(BenchbotError) as caught:
            read(tmp_path / name)
        assert why in caught.value.why


def test_kitti_files_have_no_times_to_write() -> None:
    with pytest.raises(BenchbotError, match="no times"):
        text_of(Trajectory(np.zeros((1, 3)), np.eye(3)[None]), FileFormat.TUM)
