"""The tutorial runs from its first cell to its last, and ends with a score."""

import base64
import json
import os
import sys
from io import BytesIO
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient
from PIL import Image

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("main job")]

NOTEBOOK = Path(__file__).parents[2] / "docs" / "tutorial.ipynb"


@pytest.fixture
def tutorial() -> nbformat.NotebookNode:
    notebook: nbformat.NotebookNode = nbformat.read(NOTEBOOK, as_version=4)  # type: ignore[no-untyped-call]
    return notebook


def test_it_is_kept_without_outputs(tutorial: nbformat.NotebookNode) -> None:
    code = [cell for cell in tutorial.cells if cell.cell_type == "code"]

    assert all(cell.outputs == [] and cell.execution_count is None for cell in code)


def test_it_goes_from_nothing_to_a_score(
    tutorial: nbformat.NotebookNode, tmp_path: Path, kernel_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    monkeypatch.setenv("PATH", os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    done = NotebookClient(tutorial, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()

    outputs = [output for cell in done.cells if cell.cell_type == "code" for output in cell.outputs]
    pictures = [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    sizes = [Image.open(BytesIO(base64.b64decode(picture))).size for picture in pictures]
    assert sizes[0] == (960, 720), "the observations"
    assert sizes[2] == (1840, 1000), "the map beside the truth"
    assert json.loads((tmp_path / "scores.json").read_text())["scores"]["OMQ"] > 0.85
    assert not list((tmp_path / "state").glob("runs/*/run.json")), "the back end has ended"
