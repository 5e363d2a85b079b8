"""`benchbot import-environment` as a person uses it."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchbot.cli.app import main
from plugins.scenes.tests.importing import places
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
        "my_flat_2_1.pgm",
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
