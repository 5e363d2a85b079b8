"""The commands of pages about results work as they stand, on results like those that the pages speak of."""

import json
import shlex
import shutil
import zipfile
from pathlib import Path
from typing import Any

import pytest

import benchbot_envs_bear
from benchbot.cli.app import main
from tests.docs.blocks import ROOT, blocks
from tests.garbage import searched_as_before

RUNNER = "tests/docs/test_result_pages.py"
PAGES = ["docs/evaluation.md", "docs/report.md", "docs/statistics.md"]
TRUTHS = Path(benchbot_envs_bear.__file__).parent / "ground_truths"


def result(environment: str, seed: int, off_m: float) -> dict[str, Any]:
    """Return a result of an environment: every true object but the last, this far beside where it is."""
    name, variant = environment.split(":")
    truth = json.loads((TRUTHS / f"{name}_{variant}.json").read_text("utf-8"))["ground_truth"]
    objects = [
        {
            "label_probs": [float(label == thing["class"]) for label in truth["class_list"]],
            "centroid": [thing["centroid"][0] + off_m, *thing["centroid"][1:]],
            "extent": thing["extent"],
        }
        for thing in truth["objects"][:-1]
    ]
    return {
        "task_details": {"name": "semantic_slam:passive:ground_truth", "results_format": "object_map"},
        "environment_details": [{"name": name, "variant": int(variant)}],
        "results": {"objects": objects, "class_list": truth["class_list"]},
        "seed": seed,
    }


def write(folder: Path, *environments: str, off_m: float = 0.05) -> None:
    folder.mkdir(parents=True)
    for environment in environments:
        path = folder / f"{environment.replace(':', '_')}.json"
        path.write_text(json.dumps(result(environment, 0, off_m)), "utf-8")


def type_command(command: str) -> int:
    """Run a command in this process, in the working folder; return its exit status."""
    with searched_as_before(), pytest.raises(SystemExit) as ended:
        main(shlex.split(command, comments=True)[1:])
    return int(ended.value.code or 0)


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with everything that the pages name."""
    folder = tmp_path_factory.mktemp("results")
    write(folder / "results", "miniroom:1", "miniroom:3", "house:1", "house:3")
    write(folder / "more", "miniroom:4")
    write(folder / "last", "miniroom:5")
    with zipfile.ZipFile(folder / "more.zip", "w") as archive:
        archive.write(folder / "more" / "miniroom_4.json", "miniroom_4.json")
    shutil.copyfile(folder / "last" / "miniroom_5.json", folder / "last.json")
    shutil.copyfile(folder / "results" / "miniroom_1.json", folder / "result.json")
    for name, off_m in (("new", 0.02), ("old", 0.1)):
        write(folder / name, "miniroom:1", "house:1", off_m=off_m)
    for name, off_m in (("run7", 0.02), ("run3", 0.1), ("run4", 0.05)):
        write(folder / name, "miniroom:1", "miniroom:2", off_m=off_m)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("BENCHBOT_STATE_DIR", str(folder / "state"))
            assert type_command(f"benchbot eval {folder / name} -o {folder / name}/scores.json") == 0
    return folder


@pytest.fixture
def folder(prepared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    copied = Path(shutil.copytree(prepared, tmp_path / "folder"))
    monkeypatch.chdir(copied)
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    return copied


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("name", PAGES)
def test_the_commands_of_a_page_work(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    marked = [block for block in blocks((ROOT / name).read_text("utf-8")) if block.run_by == RUNNER]
    commands = [line for block in marked for line in block.text.splitlines() if line.strip()]

    assert commands
    for command in commands:
        assert type_command(command) == 0, f"{command}\n{capsys.readouterr().err}"
