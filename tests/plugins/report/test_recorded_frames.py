"""Which frames a report takes for whose, by the numbers of their observations."""

from pathlib import Path
from typing import Any

from benchbot.core.recording import RecordingNote, RecordingState
from benchbot.evaluation.frames import frame_folders, numbered_frames
from benchbot.plugins.report.camera_pictures import frames_of
from benchbot.plugins.report.episodes import ReportData, ReportedEpisode

COLUMNS = ["observation", "time_s", "x_m", "y_m", "yaw_rad"]


def recorded(folder: Path, *numbers: int) -> Path:
    folder.mkdir()
    for number in numbers:
        (folder / f"{number:05d}.jpg").write_bytes(b"")
    return folder


def episode(observations: int) -> ReportedEpisode:
    rows = [[number, float(number), 0.5 * number, 0.0, 0.0] for number in range(observations)]
    document: dict[str, Any] = {"track": [{"columns": COLUMNS, "rows": rows}]}
    return ReportedEpisode("arena:1", 0, None, None, None, None, None, document=document)


def found(folder: Path, observations: int) -> dict[str, float]:
    one = episode(observations)
    data = ReportData(None, {}, (one,), None, None, frames=folder)  # type: ignore[arg-type]
    return {frame.path.stem: frame.base.translation_xyz[0] for frame in frames_of(one, data)}


def test_a_frame_belongs_to_the_observation_with_its_number_also_where_others_were_dropped(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "frames", 0, 1, 4)
    assert found(folder, 3) == {}
    assert found(folder, 5) == {}
    RecordingNote("frames", RecordingState.FINISHED, recorded=3, dropped=2).write(folder)
    assert found(folder, 5) == {"00000": 0.0, "00001": 0.5, "00004": 2.0}


def test_as_many_frames_as_observations_are_theirs(tmp_path: Path) -> None:
    folder = recorded(tmp_path / "frames", 0, 1, 2)
    assert list(found(folder, 3).values()) == [0.0, 0.5, 1.0]


def test_frames_with_names_of_their_own_are_taken_in_order(tmp_path: Path) -> None:
    for name in ("b.jpg", "a.jpg"):
        (tmp_path / name).write_bytes(b"")
    assert [path.name for path in numbered_frames(tmp_path).values()] == ["a.jpg", "b.jpg"]
    assert numbered_frames(tmp_path / "none") == {}


def test_frames_are_looked_for_beside_the_result() -> None:
    assert [str(path) for path in frame_folders(Path("out/run.json"))] == [
        "out/run-recordings/frames",
        "out/run.frames",
        "out/frames",
    ]
