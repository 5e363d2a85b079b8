"""A solution that has all public information and our own source code makes a held-out place again, or cannot."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml

from benchbot_eval_omq.omq import evaluate
from benchbot_scenes.catalogue import pack
from benchbot_scenes.generator.generate import generate
from tests.submission.attacks.regenerate import object_map

SOLUTION = Path(__file__).with_name("regenerate.py")
PUBLIC = ("benchbot_scenes", "benchbot_assets_household")
"""The packages that a contestant carries along, as they are published."""

PLACE = ("--kind", "office", "--rooms", "1", "--seed", "1")
RUN = ("--addons", "../asked", "--task", "map:unseen", "--robot", "carter_lowres", "--secret", "random")
SEEDS = 2
TASK = """\
name: map:unseen
description: Map the objects of a scene without having seen any, which is what the solution does.
actions: [move_next]
observations: [poses]
localisation: ground_truth
results_format: object_map
scene_count: 1
"""
"""No image is taken: to work out the light of a place that is new takes longer than all the rest."""


class Organiser:
    """An organiser's folder, with a solution's in it; commands are run there."""

    def __init__(self, folder: Path, kernels: Path) -> None:
        self.folder = folder
        self.variables = {name: value for name, value in os.environ.items() if not name.startswith("BENCHBOT_")}
        self.variables |= {f"BENCHBOT_{kind}_DIR": str(folder / "own" / kind) for kind in ("STATE", "DATA")}
        self.variables |= {"BENCHBOT_CACHE_DIR": str(kernels)}
        (folder / "solution").mkdir()
        shutil.copy(SOLUTION, folder / "solution")
        (folder / "asked" / "tasks").mkdir(parents=True)
        (folder / "asked" / "tasks" / "unseen.yaml").write_text(TASK)

    def carries_along(self) -> None:
        """Put copies of the generator and its models beside the solution."""
        for name in PUBLIC:
            spec = find_spec(name)
            assert spec is not None
            assert spec.origin is not None
            shutil.copytree(Path(spec.origin).parent, self.folder / "solution" / name)

    def benchbot(self, *words: str, within: str = ".") -> str:
        """Run a command; return what it says on stdout and stderr."""
        command = [sys.executable, "-m", "benchbot", *words]
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, cwd=self.folder / within, env=self.variables
        )
        return done.stdout + done.stderr

    def scored(self, secrets: Sequence[str] = ("",)) -> tuple[str, float]:
        """Return what the solution says, run in a sandbox and told these secrets, and its OMQ."""
        command = f"{sys.executable} regenerate.py '{','.join(secrets)}' {SEEDS}"
        held = ("--addons", "../heldout", "--env", "heldout:1", "--results-location", "../result.json")
        said = self.benchbot("submit", "--sandbox", command, *RUN, *held, within="solution")
        self.benchbot("eval", "result.json", "--addons", "heldout", "--output-location", "scores.json")
        return said, json.loads((self.folder / "scores.json").read_text())["scores"]["OMQ"]

    def guessed(self, seed: int) -> float:
        """Return the OMQ of another place's truth."""
        environment = yaml.safe_load((self.folder / "heldout" / "environments" / "heldout_1.yaml").read_text())
        truth = json.loads((self.folder / "heldout" / "ground_truths" / "heldout_1.json").read_text())
        models = pack("household")
        drawn = object_map(generate(seed, "office", 1, models), environment, models)
        result: Any = {"task_details": {"results_format": "object_map"}, "results": drawn}
        return evaluate(result, [truth])["OMQ"]


@pytest.fixture
def organiser(tmp_path: Path, kernel_cache: Path) -> Organiser:
    return Organiser(tmp_path, kernel_cache)


@pytest.mark.slow
def test_a_small_seed_is_found_by_trying(organiser: Organiser) -> None:
    organiser.carries_along()
    organiser.benchbot("generate-environment", *PLACE, "--name", "heldout")

    said, omq = organiser.scored()

    assert "found: office 1 1" in said
    assert omq == pytest.approx(1.0)


@pytest.mark.slow
def test_with_a_secret_all_that_is_public_is_worth_no_more_than_a_guess(organiser: Organiser) -> None:
    organiser.carries_along()
    (organiser.folder / "secret").write_text(f"{'5ec2e7' * 11}\n")
    organiser.benchbot("generate-environment", *PLACE, "--name", "heldout", "--secret", "secret")
    (origin,) = organiser.folder.glob("*.origin.json")
    commitment = json.loads(origin.read_text())["secret_sha256"]

    said, omq = organiser.scored(["", commitment])

    assert "not found" in said
    assert omq <= max(organiser.guessed(seed) for seed in range(100, 103)) < 0.5


def test_in_a_sandbox_there_is_no_generator_but_one_carried_along(organiser: Organiser) -> None:
    organiser.benchbot("generate-environment", *PLACE, "--name", "heldout")

    said, omq = organiser.scored()

    assert "No module named 'benchbot_scenes" in said
    assert omq == 0.0
