"""`benchbot import-environment --splats`, and runs in what it makes."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from benchbot.cli.app import main
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.importing import understanding
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.splats import Splats, transformed
from plugins.scenes.tests.importing import places
from plugins.scenes.tests.importing.trained import on_mesh, write_ply
from tests.garbage import searched_as_before
from tests.ray_tracing import benchbot

pytestmark = pytest.mark.xdist_group("renderer")

TO_FILE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
RUN = ("submit", "--task", "semantic_slam:passive:ground_truth:segmentation", "--robot", "carter_lowres")
SEEN = ("--env", "flat:1", "--seed", "3", "--evaluate-with", "omq")


@pytest.fixture(autouse=True)
def process(monkeypatch: pytest.MonkeyPatch, kernel_cache: Path) -> Iterator[None]:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(kernel_cache))
    with searched_as_before():
        yield


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    return places.write(tmp_path / "flat.glb", places.flat(window=False))


def splats_of(mesh: Path) -> Splats:
    """Splats on a mesh, in the frame of its file."""
    found = understanding.understand(mesh, Guesses(units="m", up="y", floor_z_m=0.0)).geometry
    return transformed(on_mesh(found, per_m2=500.0), TO_FILE)


def _run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return int(ended.value.code or 0)


def test_scores_are_those_of_the_mesh_and_colours_those_of_the_splats(
    mesh: Path, kernel_cache: Path, tmp_path: Path
) -> None:
    cloud = write_ply(tmp_path / "point_cloud.ply", splats_of(mesh))
    made, plain = tmp_path / "made", tmp_path / "plain"
    words = ("import-environment", str(mesh), "--robot", "carter_lowres", "--no-pictures", "--json")
    told = json.loads(benchbot(tmp_path, *words, "-o", str(made), "--splats", str(cloud), cache=kernel_cache))
    assert told["splats"]["alignment"]["near_share"] > 0.9
    assert told["splats"]["number"] > 10_000
    assert json.loads(benchbot(tmp_path, *words, "-o", str(plain), cache=kernel_cache))["splats"] is None
    assert load_scene(made / "scenes" / "flat_1.glb").splats is not None
    assert (made / "ground_truths" / "flat_1.json").read_bytes() == (
        plain / "ground_truths" / "flat_1.json"
    ).read_bytes()
    for example in ("hello_passive", "segmentation_mapper"):
        scores = []
        for folder in (made, plain):
            results = ("--example", example, "--results-location", str(tmp_path / f"{folder.name}_{example}.json"))
            scores.append(
                benchbot(tmp_path, *RUN, "--addons", str(folder), *SEEN, *results, cache=kernel_cache).split()
            )
        assert scores[0][-1] == scores[1][-1]
        assert (float(scores[0][-1]) > 0.5) == (example == "segmentation_mapper")


def test_splats_of_another_place_are_told_once_all_is_written(
    mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cloud = write_ply(tmp_path / "point_cloud.ply", transformed(splats_of(mesh), TO_FILE))
    folder = tmp_path / "made"
    assert _run("import-environment", str(mesh), "-o", str(folder), "--splats", str(cloud), "--no-pictures") == 2
    shown = capsys.readouterr()
    assert "are not where its mesh is" in shown.err
    assert "another axis is up" in " ".join(shown.err.split())
    assert (folder / "scenes" / "flat_1.glb").is_file()


def test_a_shift_is_warned_of(mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cloud = write_ply(tmp_path / "point_cloud.ply", transformed(splats_of(mesh), offset=(0.0, 0.0, -0.1)))
    folder = tmp_path / "made"
    words = ("-o", str(folder), "--splats", str(cloud), "--no-pictures", "--json")
    assert _run("import-environment", str(mesh), *words) == 0
    told = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(told["splats"]["alignment"]["shift_m"], (0.0, 0.1, 0.0), atol=0.02)
    assert any("They seem shifted by" in note for note in told["notes"])
    assert "They seem shifted by" in (folder / "report.html").read_text()


def test_a_mesh_in_place_of_splats_is_refused(mesh: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = places.write(tmp_path / "other.ply", places.flat(), up="z")
    folder = tmp_path / "made"
    assert _run("import-environment", str(mesh), "-o", str(folder), "--splats", str(other)) == 2
    assert "no file of Gaussian splats" in capsys.readouterr().err
    assert not folder.exists()
