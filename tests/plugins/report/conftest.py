"""Results of two flats with all that a report shows: objects found, missed and made up, a track, frames, failures."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from benchbot.core.declarations.catalog import Catalog
from benchbot.evaluation.score import score_files
from benchbot.plugins.report.episodes import ReportData, gather
from tests.made_results import Make, Save

Report = Callable[..., ReportData]

START = [1.0, 0.0, 0.0, 0.0, -3.0, 0.0, 0.0]
TRACK = {
    "scene": "flat:1",
    "source": "simulation",
    "path_length_m": 1.5,
    "collisions": 1,
    "columns": ["observation", "time_s", "x_m", "y_m", "yaw_rad"],
    "rows": [[i if i % 2 == 0 else None, 0.5 * i, -3.0 + 0.1 * i, 0.05 * i, 0.0] for i in range(9)],
}


def provenance(seed: int = 0, failure: tuple[str, str] | None = None, **selection: Any) -> dict[str, Any]:
    return {
        "benchbot": "0.1.0",
        "plugins": {"benchbot-sim-taichi": {"version": "0.1.0", "sha256": "ab" * 32}},
        "selection": {"task": "t", "robot": "carter_lowres", "environment": "flat:1", "seed": seed, **selection},
        "solution": {"command": ["python", "my_mapper.py"], "files": {"my_mapper.py": "00"}, "git_revision": "f" * 40},
        "steps": 8,
        "simulated_time_s": 4.0,
        "failure": None if failure is None else {"class": failure[0], "why": failure[1]},
        "observation_digest": "cd" * 32,
    }


@pytest.fixture
def results(make_result: Make, save: Save, tmp_path: Path) -> list[Path]:
    """Two seeds in flat:1, a collision in flat:2 that was scored all the same, and an episode that ran out of time."""
    good = make_result(0.1, 3.0, provenance=provenance(0), track=[TRACK])
    # A chair is missed, and a table is where nothing is.
    poor = make_result(0.2, provenance=provenance(1), track=[TRACK])
    poor["results"]["objects"].append(
        {"label_probs": [0.1, 0.8, 0.1], "centroid": [1.5, 1.0, 0.5], "extent": [0.5, 0.5, 1.0]}
    )
    crashed = make_result(0.0, variant=2, provenance=provenance(0, ("collision", "It touched a table.")))
    late = make_result(variant=2, provenance=provenance(1, ("timeout", "It took longer than 600 s.")))
    del late["results"]
    found = {"good": good, "poor": poor, "crashed": crashed, "late": late}
    return [save(f"{name}.json", document) for name, document in found.items()]


@pytest.fixture
def frames(tmp_path: Path, results: list[Path]) -> Path:
    """What was recorded beside `poor.json`: five pictures of the size of carter_lowres's camera."""
    folder = tmp_path / "poor.frames"
    folder.mkdir()
    ramp = np.linspace(0, 255, 320, dtype=np.uint8)
    for i in range(5):
        picture = np.stack(
            [np.tile(ramp, (180, 1)), np.full((180, 320), 40 * i, np.uint8), np.tile(ramp[::-1], (180, 1))]
        )
        Image.fromarray(np.ascontiguousarray(picture.transpose(1, 2, 0))).save(folder / f"{i:05d}.jpg")
    return folder


@pytest.fixture
def report(catalog: Catalog) -> Report:
    """Gathers what a report on these files is made of."""

    def make(paths: list[Path], *, name: str | None = None, frames: Path | None = None, **options: Any) -> ReportData:
        evaluation = score_files(paths, catalog=catalog, **options)
        return gather(evaluation, paths, catalog=catalog, name=name, frames=frames)

    return make
