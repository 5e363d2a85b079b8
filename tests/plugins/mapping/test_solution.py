"""The mapper of docs/mapping.md, to the byte: driving, on a recording, in a sandbox, without OpenCV."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations.formats import check_format
from benchbot.mapping import create_object
from tests.cli.submitted import SELECTION, read
from tests.command_line import CommandLine
from tests.docs.blocks import ROOT, blocks

PLUGINS = "benchbot-sample,benchbot-eval-omq,benchbot-record-mcap,benchbot-replay"
MAPPER = next(
    block.text for block in blocks((ROOT / "docs" / "mapping.md").read_text("utf-8")) if "my_mapper.py" in block.info
)
WITHOUT_OPENCV = "import sys\n\nsys.modules['cv2'] = None\n"


def objects(path: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = read(path)["results"]["objects"]
    return found


@pytest.fixture
def mapper(cli: CommandLine) -> str:
    cli.variables["BENCHBOT_PLUGINS"] = PLUGINS
    return cli.script("my_mapper.py", WITHOUT_OPENCV + MAPPER)


def test_it_maps_in_a_sandbox_and_again_on_the_recording_of_that(cli: CommandLine, mapper: str) -> None:
    held = cli("submit", "--sandbox", mapper, *SELECTION, "-r", "held.json", "--record", "mcap")
    assert held.returncode == 0, held.stderr
    native = cli("replay", "held-recordings/mcap", "--native", mapper, "-r", "again.json", "--display", "none")
    assert native.returncode == 0, native.stderr

    assert len(objects(cli.folder / "held.json")) > 2
    assert objects(cli.folder / "again.json") == objects(cli.folder / "held.json")


def test_a_mistake_is_told_at_the_line_of_the_solution(cli: CommandLine) -> None:
    wrong = MAPPER.replace("label_probs=item.label_probs", 'label_probs={"chiar": 1.0}')
    done = cli("submit", "--native", cli.script("wrong.py", wrong), *SELECTION, "-r", "wrong.json")
    line = wrong[: wrong.index("create_object(\n")].count("\n") + 1

    assert done.returncode != 0
    assert f'wrong.py", line {line}' in done.stderr
    assert "the class 'chiar' is not in class_list. Did you mean 'chair'?" in done.stderr


def test_the_page_says_what_an_object_of_the_format_is() -> None:
    """The JSON on the page is valid, and so is what create_object makes of it."""
    page = (ROOT / "docs" / "mapping.md").read_text("utf-8")
    shown = json.loads(next(block.text for block in blocks(page) if block.language == "json"))

    check_format("object_map", shown)
    assert [create_object(class_list=shown["class_list"], **item) for item in shown["objects"]] == shown["objects"]
