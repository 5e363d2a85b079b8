"""Every command of docs/examples.md runs as it stands there, and does what it says."""

import json
import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load
from tests.docs.blocks import ROOT
from tests.docs.commands import back_end, succeed

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("main job")]

PAGE = (ROOT / "docs" / "examples.md").read_text("utf-8")


@dataclass(frozen=True)
class Section:
    """A back end, and what is submitted to it."""

    run: str
    submissions: list[str]


SECTIONS = [
    Section(run, re.findall(r"\| `(benchbot submit .*?)` \|", table))
    for run, table in re.findall(r"```bash\n(benchbot run .*?)\n```\n(.*?)(?=\n## |\Z)", PAGE, re.DOTALL)
]


@dataclass(frozen=True)
class Output:
    """What an example left: the folder it was submitted from, what was printed, and the result."""

    folder: Path
    data: str
    notes: str
    document: dict[str, Any]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory, kernel_cache: Path) -> dict[str, Output]:
    outputs = {}
    for section in SECTIONS:
        folder = tmp_path_factory.mktemp("examples")
        with back_end(section.run, folder, kernel_cache) as environment:
            for command in section.submissions:
                done = succeed(command, folder, environment)
                # The back end keeps one result, that of the last submission.
                (path,) = re.findall(r"^Result: (.*)$", done.stderr, re.MULTILINE)
                document = json.loads(Path(path).read_text())
                outputs[shlex.split(command)[3]] = Output(folder, done.stdout, done.stderr, document)
    return outputs


def test_every_example_of_the_distributions_is_on_the_page() -> None:
    ours = [item for item in Catalog(load()).pool("examples").values() if item.distribution.startswith("benchbot")]
    examples = {item.name for item in ours if item.distribution in {"benchbot", "benchbot-task-semslam"}}

    assert {shlex.split(command)[3] for section in SECTIONS for command in section.submissions} == examples


@pytest.mark.parametrize("name", ["hello_passive", "hello_args", "gym_loop", "data_collect", "hello_active"])
def test_the_small_ones_save_a_map_without_objects(outputs: dict[str, Output], name: str) -> None:
    assert outputs[name].document["results"]["objects"] == []


def test_arguments_arrive(outputs: dict[str, Output]) -> None:
    assert len(re.findall(r"^solution \| Hi from \(.*\) m", outputs["hello_args"].notes, re.MULTILINE)) == 3


def test_collected_data_can_be_read(outputs: dict[str, Output]) -> None:
    folder = outputs["data_collect"].folder / "data" / "miniroom_1" / "000000"
    camera = json.loads((folder / "cameras.json").read_text())["image_depth_info"]
    poses = [json.loads(path.read_text()) for path in sorted(folder.glob("*_poses.json"))]
    depth, classes, instances, laser = (
        np.load(folder / f"0005_{name}.npy") for name in ("depth", "class", "instance", "laser")
    )

    shape = camera["height"], camera["width"]
    assert len(poses) == 6
    assert len(poses[0]["camera"]["translation_xyz"]) == 3
    assert Image.open(folder / "0005_rgb.png").size == shape[::-1]
    assert depth.shape == classes.shape == instances.shape == shape
    assert (depth.dtype, classes.dtype, instances.dtype) == (np.float32, np.uint8, np.uint16)
    assert laser.shape == (900, 2)
    assert "chair" in json.loads((folder / "classes.json").read_text())


@pytest.mark.parametrize("name", ["segmentation_mapper", "frontier"])
def test_those_that_map_score_what_the_page_says(outputs: dict[str, Output], name: str) -> None:
    said = float(re.findall(rf"`benchbot submit --example {name} .*OMQ ([0-9.]+)", PAGE)[0])

    assert float(outputs[name].data.removeprefix("OMQ ")) == pytest.approx(said, abs=0.02)
    assert len(outputs[name].document["results"]["objects"]) == 18


def test_the_explorer_ends_by_itself_and_touches_nothing(outputs: dict[str, Output]) -> None:
    assert "No frontier is left" in outputs["frontier"].notes
    assert outputs["frontier"].document["provenance"]["failure"] is None


def test_a_scene_that_stays_the_same_has_no_changes(outputs: dict[str, Output]) -> None:
    output = outputs["scene_change_mapper"]

    assert "0 changes" in output.notes
    assert output.document["results"]["objects"] == []
    assert len(output.document["environment_details"]) == 2
