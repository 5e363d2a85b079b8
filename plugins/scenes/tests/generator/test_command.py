"""New environments and maps from the command line."""

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

from benchbot.cli.app import main
from benchbot.core.declarations import schema
from benchbot_scenes.layout import read_layout
from tests.garbage import searched_as_before

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def benchbot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Iterator[Run]:
    """Runs a command in an empty folder, in this process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))

    def run(*words: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(words)
        out, err = capfd.readouterr()
        return int(ended.value.code or 0), out, err

    with searched_as_before():
        yield run


def test_a_seed_becomes_a_folder_that_others_can_use(benchbot: Run, tmp_path: Path) -> None:
    code, out, err = benchbot(
        *("generate-environment", "--kind", "apartment", "--rooms", "2", "--seed", "5", "--json"),
        *("--output-location", "flat", "--name", "flat"),
    )
    assert code == 0, err
    summary = json.loads(out)
    folder = tmp_path / "flat"
    assert sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()) == [
        ".schemas/environment.json",
        "environments/flat_1.yaml",
        "ground_truths/flat_1.json",
        "layouts/flat_1.yaml",
        "maps/flat_1.pgm",
        "maps/flat_1.png",
        "maps/flat_1.yaml",
    ]
    declared = yaml.safe_load((folder / "environments" / "flat_1.yaml").read_text())
    schema.check(declared, "environment", folder / "environments" / "flat_1.yaml")
    named = re.match(r"# yaml-language-server: \$schema=(.+)\n", (folder / "environments" / "flat_1.yaml").read_text())
    assert named is not None
    assert (folder / "environments" / named[1]).is_file()
    assert read_layout(folder / "environments" / declared["map_path"]).assets == "household"
    assert len(declared["trajectory_poses"]) == summary["trajectory_poses"]
    truth = json.loads((folder / "ground_truths" / "flat_1.json").read_text())
    assert len(truth["ground_truth"]["objects"]) == summary["objects"] == sum(summary["classes"].values())
    assert summary["least_clearance_m"] >= 0.3


@pytest.mark.parametrize(
    ("words", "title"),
    [
        (("--kind", "castle"), "There is no kind of place 'castle'"),
        (("--rooms", "40"), "A place cannot have 40 rooms"),
        (("--seed", "-3"), "-3 is not a seed"),
        (("--name", "a b"), "'a b' cannot name an environment"),
        (("--assets", "nothing"), "nothing"),
        (("--robot", "nobody"), "nobody"),
    ],
)
def test_what_cannot_be_is_refused_and_leaves_nothing(
    benchbot: Run, tmp_path: Path, words: tuple[str, ...], title: str
) -> None:
    code, out, err = benchbot("generate-environment", *words)
    assert code == 2
    assert out == ""
    assert title in err
    assert not list(tmp_path.iterdir())


def test_a_folder_with_something_in_it_is_not_written_to(benchbot: Run, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("42 pages")
    code, _, err = benchbot("generate-environment", "--output-location", "mine")
    assert code == 2
    assert "mine is there already" in err
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def test_a_map_of_an_installed_environment(benchbot: Run, tmp_path: Path) -> None:
    code, out, err = benchbot("map", "miniroom:1", "--output-location", "maps")
    assert code == 0, err
    names = ["miniroom_1.pgm", "miniroom_1.yaml", "miniroom_1.png"]
    assert [Path(line).name for line in out.split()] == names
    assert all((tmp_path / "maps" / name).stat().st_size for name in names)


def test_an_unknown_environment_has_no_map(benchbot: Run, tmp_path: Path) -> None:
    code, _, err = benchbot("map", "minirom:1")
    assert code == 2
    assert "miniroom:1" in err
    assert not list(tmp_path.iterdir())
