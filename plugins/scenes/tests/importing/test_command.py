"""`benchbot import-environment` as a person uses it."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchbot.cli.app import main
from benchbot_scenes.importing import report
from plugins.scenes.tests.importing import places, scanned
from tests.garbage import searched_as_before


@pytest.fixture(autouse=True)
def collector() -> Iterator[None]:
    with searched_as_before():
        yield


def _run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["import-environment", *words])
    return int(ended.value.code or 0)


def test_an_environment_is_made(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = places.write(tmp_path / "My flat (2).stl", places.flat(ceiling=False), 1000.0, "z")
    folder = tmp_path / "made"
    assert _run(str(source), "-o", str(folder), "--no-pictures", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["environment"], told["units"], told["up"]) == ("my_flat_2:1", "mm", "z")
    assert told["size_m"] == pytest.approx([5.2, 4.2, 2.7], abs=1e-3)
    assert {path.name for path in folder.rglob("*") if path.is_file()} == {
        "environment.json",
        "my_flat_2_1.glb",
        "my_flat_2_1.json",
        "my_flat_2_1.png",
        "my_flat_2_1.yaml",
        "guesses.yaml",
        "report.html",
    }
    assert _run(str(source), "-o", str(folder)) == 2
    assert "there already" in capsys.readouterr().err


def test_options_win_over_guesses_and_guesses_over_what_is_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = places.write(tmp_path / "flat.stl", places.flat(ceiling=False), up="z")
    (tmp_path / "known.yaml").write_text("units: in\nup: y\nfloor_z_m: 0.2\n")
    folder = tmp_path / "made"
    words = [str(source), "-o", str(folder), "--guesses", str(tmp_path / "known.yaml"), "--units", "m", "--up", "z"]
    assert _run(*words, "--floor-z", "0", "--name", "room", "--no-pictures") == 0
    shown = capsys.readouterr().out
    assert "room:1" in shown
    assert "m: as told" in shown
    assert "open from above" not in shown


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.glb"], "no file"),
        (["flat.stl", "--name", "a:b"], "cannot be an environment's name"),
        (["flat.stl", "--robot", "cartre"], "Did you mean 'carter"),
        (["flat.stl", "--guesses", "wrong.yaml"], "wrong.yaml:2"),
        (["flat.stl", "--guesses", "light.yaml"], "light.yaml:2"),
        (["flat.stl", "--guesses", "class.yaml"], "Did you mean 'chair'"),
    ],
)
def test_mistakes_are_explained_and_leave_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    places.write(tmp_path / "flat.stl", places.flat(), up="z")
    (tmp_path / "wrong.yaml").write_text("up: z\nunit: cm\n")
    (tmp_path / "light.yaml").write_text("up: z\nlighting: {tiem: '21:30'}\n")
    (tmp_path / "class.yaml").write_text("classes: {Stuhl: chiar}\n")
    assert _run(*words, "-o", "made", "--no-pictures") == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "made").exists()


def test_robot_and_start_are_kept_for_the_next_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = places.write(tmp_path / "flat.glb", places.flat())
    made = tmp_path / "made"
    words = [str(source), "--no-pictures", "-o"]
    assert _run(*words, str(made), "--robot", "carter_lowres", "--start", "3.0,1.0,90") == 0
    assert "--robot carter_lowres" in capsys.readouterr().err
    assert _run(*words, str(tmp_path / "again"), "--guesses", str(made / "guesses.yaml"), "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["robot"], told["start_pose"][4:6]) == ("carter_lowres", [3.0, 1.0])
    assert _run(*words, str(tmp_path / "wrong"), "--start", "here") == 2
    assert "is no start" in capsys.readouterr().err


def test_the_report_is_there_before_the_pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = places.write(tmp_path / "flat.glb", places.flat())

    def interrupted(*_: object) -> None:
        assert "Mug" in (tmp_path / "made" / "report.html").read_text()
        raise KeyboardInterrupt

    monkeypatch.setattr(report, "views", interrupted)
    assert _run(str(source), "-o", str(tmp_path / "made")) == 130
    assert "Mug" in (tmp_path / "made" / "report.html").read_text()


def test_a_robot_that_can_hardly_move_and_sees_nothing_fails_with_a_report(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = [places.Box("floor", (0, 0, -0.1), (0.8, 0.8, 0)), places.Box("Chair", (4, 4, 0), (4.5, 4.5, 0.9))]
    source = places.write(tmp_path / "cell.glb", cell)
    assert _run(str(source), "--no-pictures", "--floor-z", "0", "-o", str(tmp_path / "made"), "--json") == 2
    told = capsys.readouterr()
    assert any("only" in note and "poses" in note for note in json.loads(told.out)["notes"])
    assert "sees nothing" in told.err
    assert "--start" in told.err
    assert (tmp_path / "made" / "report.html").exists()
    assert (tmp_path / "made" / "environments" / "cell_1.yaml").exists()


def test_labels_are_told_and_what_became_no_class(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scan = scanned.scannetpp(tmp_path)
    assert _run(str(scan), "--name", "lab", "-o", str(tmp_path / "made"), "--no-pictures") == 0
    told = capsys.readouterr()
    assert "ScanNet++: 12 objects, 5 of a class" in told.out
    assert "none of the classes: 4 wall, 1 cabinet, 1 floor." in told.err
    assert "not known: 1 zorbing ball." in told.err
    page = (tmp_path / "made" / "report.html").read_text()
    assert "dining table" in page
    assert "not known" in page
    assert _run(str(scan), "--labels", "none", "-o", str(tmp_path / "bare"), "--no-pictures", "--json") == 0
    assert json.loads(capsys.readouterr().out)["labels"] is None
