"""Models made again are the committed ones, and the same bytes in every process."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import benchbot_assets_household
from tools.household.catalogue import items
from tools.household.pack import write_catalogue, write_models

SAMPLE = ("apple_green", "interior_door_oak", "keyboard_white", "table_lamp_desk", "bookcase_oak")
COMMITTED = json.loads((Path(benchbot_assets_household.__file__).parent / "catalogue.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("pack")
    command = [sys.executable, "-m", "tools.household", *SAMPLE, "--folder", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    return path


def test_entries_equal_the_committed_ones(folder: Path) -> None:
    made = json.loads((folder / "catalogue.json").read_text(encoding="utf-8"))["models"]
    committed = {entry["id"]: entry for entry in COMMITTED["models"]}
    assert [entry["id"] for entry in made] == sorted(SAMPLE)
    assert made == [committed[entry["id"]] for entry in made]


def test_another_process_writes_the_same_bytes(folder: Path, tmp_path: Path) -> None:
    write_catalogue(write_models([item for item in items() if item.id in SAMPLE], tmp_path), tmp_path)
    for path in [*(folder / "models").iterdir(), folder / "catalogue.json"]:
        assert (tmp_path / path.relative_to(folder)).read_bytes() == path.read_bytes()


def test_models_made_earlier_stay_in_the_catalogue(folder: Path) -> None:
    command = [sys.executable, "-m", "tools.household", "apple_green", "--folder", str(folder)]
    before = (folder / "catalogue.json").read_bytes()
    subprocess.run(command, check=True, capture_output=True)
    assert (folder / "catalogue.json").read_bytes() == before


def test_other_lists_are_joined_in(folder: Path, tmp_path: Path) -> None:
    entry = dict(json.loads((folder / "catalogue.json").read_text(encoding="utf-8"))["models"][0], id="zebra_1", seed=4)
    (tmp_path / "models").mkdir()
    shutil.copy(folder / entry["file"], tmp_path / "models")
    (tmp_path / "models" / "baked.json").write_text(json.dumps([entry]), encoding="utf-8")
    write_catalogue([], tmp_path)
    joined = json.loads((tmp_path / "catalogue.json").read_text(encoding="utf-8"))["models"]
    assert [item["id"] for item in joined] == ["zebra_1"]
    assert "seed" not in joined[0]


def test_an_unknown_model_is_refused_with_what_there_is() -> None:
    result = subprocess.run(
        [sys.executable, "-m", "tools.household", "unicorn"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 2
    assert "apple_green" in result.stderr
    assert "Traceback" not in result.stderr


def test_ids_are_unique_and_plain() -> None:
    ids = [item.id for item in items()]
    assert len(ids) == len(set(ids))
    assert all(name.replace("_", "").isalnum() and name == name.lower() for name in ids)
