"""New environments and maps from the command line."""

import hashlib
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
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flat", "flat.origin.json"]
    assert sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()) == [
        ".schemas/environment.json",
        "environments/flat_1.yaml",
        "ground_truths/flat_1.json",
        "layouts/flat_1.yaml",
        "maps/flat_1.png",
        "maps/flat_1.yaml",
        "maps/flat_1_above.png",
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
        (("--secret", "nowhere"), "There is no secret in nowhere"),
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


SECRET = "0123456789abcdef" * 4
OFFICE = ("generate-environment", "--kind", "office", "--rooms", "1")


def words_in(folder: Path) -> dict[str, str]:
    """The text of each file, and its name with it."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {(name := str(path.relative_to(folder))): name + path.read_bytes().decode("latin-1") for path in files}


@pytest.mark.parametrize("secret", [(), ("--secret", "secret")])
def test_no_file_of_a_place_holds_its_kind_seed_or_secret_but_the_one_beside_it(
    benchbot: Run, tmp_path: Path, secret: tuple[str, ...]
) -> None:
    (tmp_path / "secret").write_text(f"{SECRET}\n")
    seed = 2**256 - 1

    code, out, err = benchbot(*OFFICE, "--seed", str(seed), *secret, "--name", "held", "--json")

    assert code == 0, err
    origin = tmp_path / "held.origin.json"
    assert json.loads(out)["origin"] == str(origin)
    assert origin.stat().st_mode & 0o777 == 0o600
    noted = json.loads(origin.read_text())
    assert (noted["environment"], noted["kind"], noted["rooms"], noted["seed"]) == ("held:1", "office", 1, seed)
    digest = hashlib.sha256((tmp_path / "secret").read_bytes()).hexdigest()
    assert noted.get("secret_sha256") == (digest if secret else None)
    assert SECRET not in origin.read_text()
    of_place = {name: text for name, text in words_in(tmp_path / "held").items() if not name.startswith(".schemas/")}
    for name, text in of_place.items():
        # Rooms and models are told in layouts only, which are ground truth themselves.
        kinds = () if name.startswith("layouts/") else ("office",)
        assert [word for word in (str(seed), "seed", SECRET, digest, *kinds) if word in text] == [], name
    declared = yaml.safe_load((tmp_path / "held" / "environments" / "held_1.yaml").read_text())
    assert declared["description"] == "A generated place."
    # What is random in a run could be worked out without a secret of its own.
    assert declared.get("hidden", False) == bool(secret)


def test_a_secret_gives_the_same_bytes_again_and_a_name_that_tells_nothing(benchbot: Run, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text(SECRET)
    for folder in ("one", "two"):
        code, _, err = benchbot(*OFFICE, "--seed", "7", "--secret", "secret", "--output-location", folder)
        assert code == 0, err
    assert words_in(tmp_path / "one") == words_in(tmp_path / "two")
    (declared,) = (tmp_path / "one" / "environments").iterdir()
    assert re.fullmatch("place_[0-9a-f]{8}_1.yaml", declared.name)


def test_how_another_place_was_made_is_not_written_over(benchbot: Run, tmp_path: Path) -> None:
    (tmp_path / "held.origin.json").write_text("the only note")
    code, _, err = benchbot(*OFFICE, "--output-location", "held")
    assert code == 2
    assert "held.origin.json is there already" in err
    assert (tmp_path / "held.origin.json").read_text() == "the only note"
    assert not (tmp_path / "held").exists()


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
    names = ["miniroom_1.png", "miniroom_1.yaml", "miniroom_1_above.png"]
    assert [Path(line).name for line in out.split()] == names
    assert all((tmp_path / "maps" / name).stat().st_size for name in names)


def test_an_unknown_environment_has_no_map(benchbot: Run, tmp_path: Path) -> None:
    code, _, err = benchbot("map", "minirom:1")
    assert code == 2
    assert "miniroom:1" in err
    assert not list(tmp_path.iterdir())
