"""Result files to look through, written by hand: a perfect one, an empty one, and one that is none."""

import json
from pathlib import Path

import yaml

SAMPLE = Path(__file__).parents[2] / "sample_plugin" / "benchbot_sample"
BOTTLE = {"label_probs": [1, 0], "centroid": [2.2, -1.2, 0.5], "extent": [1, 1, 1]}


def write_results(folder: Path) -> Path:
    """Write `perfect.json`, `one/result.json` and `nonsense.json`; return the folder."""
    details = {
        "task_details": yaml.safe_load((SAMPLE / "tasks" / "passive.yaml").read_text()),
        "environment_details": [yaml.safe_load((SAMPLE / "environments" / "arena_1.yaml").read_text())],
    }
    (folder / "one").mkdir(parents=True)
    for name, objects in (("perfect.json", [BOTTLE]), ("one/result.json", [])):
        results = {"class_list": ["bottle", "background"], "objects": objects}
        (folder / name).write_text(json.dumps({**details, "results": results}))
    (folder / "nonsense.json").write_text('{"shopping": ["milk"]}')
    return folder
