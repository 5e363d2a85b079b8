"""A plug-in with two flats whose truth is known, and results to score against it."""

import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import Plugins, installed
from tests.plugin_factory import PluginFactory

CLASSES = ["chair", "table", "background"]

FLATS = """\
from pathlib import Path
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_environments():
    yield Path(__file__).parent / "environments"

@hookimpl
def benchbot_ground_truths():
    yield Path(__file__).parent / "ground_truths"
"""

ENVIRONMENT = "name: flat\nvariant: {}\ntype: sim_sample\nmap_path: none\nstart_pose: [1, 0, 0, 0, 0, 0, 0]\n"


def ground_truth(variant: int, *objects: dict[str, Any]) -> dict[str, Any]:
    return {
        "environment": {"name": "flat", "variant": variant},
        "format": {"name": "object_map_ground_truth"},
        "ground_truth": {"objects": list(objects), "class_list": CLASSES, "synonyms": {}},
    }


def chair(x: float) -> dict[str, Any]:
    return {"class": "chair", "ID_name": f"chair {x}", "centroid": [x, 0, 0], "extent": [1, 1, 1], "isgroup": False}


@pytest.fixture
def catalog(tmp_path: Path) -> Iterator[Catalog]:
    """All installed plug-ins, and one with flat:1 (chairs at 0 and 3 m), flat:2 (at 0 m) and flat:3 (no truth)."""
    site = tmp_path / "site"
    site.mkdir()
    sys.path.insert(0, str(site))
    truths = {1: ground_truth(1, chair(0.0), chair(3.0)), 2: ground_truth(2, chair(0.0))}
    files = {f"environments/flat_{variant}.yaml": ENVIRONMENT.format(variant) for variant in (1, 2, 3)}
    files |= {f"ground_truths/flat_{variant}.json": json.dumps(truth) for variant, truth in truths.items()}
    PluginFactory(site).make("flats-for-evaluation", FLATS, files)
    sys.modules.pop("flats_for_evaluation", None)
    yield Catalog(Plugins(installed()))
    sys.path.remove(str(site))


Make = Callable[..., dict[str, Any]]
MakeRun = Callable[..., dict[str, Any]]
Save = Callable[[str, Any], Path]


@pytest.fixture
def make_result() -> Make:
    """Make a semantic SLAM result: chairs found at `places` in flat:`variant`."""

    def make(*places: float, variant: int | list[int] = 1, **keys: Any) -> dict[str, Any]:
        variants = variant if isinstance(variant, list) else [variant]
        objects = [
            {"label_probs": [1.0, 0.0, 0.0], "centroid": [x, 0.0, 0.0], "extent": [1.0, 1.0, 1.0]} for x in places
        ]
        return {
            "task_details": {"name": "semantic_slam:passive:ground_truth", "results_format": "object_map"},
            "environment_details": [{"name": "flat", "variant": number} for number in variants],
            "results": {"objects": objects, "class_list": CLASSES},
        } | keys

    return make


@pytest.fixture
def save(tmp_path: Path) -> Save:
    """Write a document, or text, into a file of this name."""

    def write(name: str, document: Any) -> Path:
        path = tmp_path / name
        path.write_text(document if isinstance(document, str) else json.dumps(document), encoding="utf-8")
        return path

    return write


@pytest.fixture
def make_run(make_result: Make) -> MakeRun:
    """Make a result as `make_result` does, with provenance; keys such as `seed` go into what was selected."""

    def make(*places: float, variant: int = 1, **selection: Any) -> dict[str, Any]:
        provenance = {
            "benchbot": "0.1.0",
            "plugins": {},
            "selection": {"task": "t", "robot": "r", "environment": f"flat:{variant}", "seed": 0, **selection},
            "steps": 3,
            "simulated_time_s": 1.0,
            "failure": None,
            "observation_digest": "00",
        }
        return make_result(*places, variant=variant, provenance=provenance)

    return make


@pytest.fixture
def failed_episode(make_run: MakeRun) -> dict[str, Any]:
    """What is left of an episode in flat:2 whose solution crashed."""
    document = make_run(variant=2)
    del document["results"]
    document["provenance"]["failure"] = {"class": "agent", "why": "It exited with status 1."}
    return document
