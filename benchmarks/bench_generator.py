"""Places from many seeds: whether each can be made and driven, what is in them, how long it takes.

python -m benchmarks.bench_generator [--seeds 200] [--first 0] [--scenes 10] [--json FILE]

Seeds go through all kinds of places, and one to eight rooms. Of every place the least clearance on the straight way
through its trajectory is measured among its furniture's boxes; of `--scenes` of them also in the composed scene.
"""

import argparse
import json
import statistics
import tempfile
import time
from collections import Counter
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot_scenes.catalogue import pack
from benchbot_scenes.compose import compose
from benchbot_scenes.coverage import least_room
from benchbot_scenes.free_space import free_space
from benchbot_scenes.generator.generate import Generated, generate
from benchbot_scenes.generator.kinds import KINDS
from benchbot_scenes.generator.proxy import class_counts
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.visibility import CARTER

MOST_ROOMS = 8


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--scenes", type=int, default=10, help="how many are composed and measured again")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    catalogue = pack("household")
    kinds = list(KINDS)
    classes: Counter[str] = Counter()
    times_s, objects, poses, failures, tight = [], [], [], [], []
    composed_m: dict[int, float] = {}
    for seed in range(options.first, options.first + options.seeds):
        kind, rooms = kinds[seed % len(kinds)], 1 + (seed // len(kinds)) % MOST_ROOMS
        started = time.process_time()
        try:
            place = generate(seed, kind, rooms, catalogue)
        except BenchbotError as error:
            failures.append((seed, kind, rooms, error.title))
            continue
        times_s.append(time.process_time() - started)
        counts = class_counts(place.items)
        classes.update(counts)
        objects.append(sum(counts.values()))
        poses.append(len(place.trajectory_poses))
        if (seed - options.first) * options.scenes // options.seeds > len(composed_m) - 1:
            composed_m[seed] = _composed_room(place)
            if composed_m[seed] < CARTER.radius_m:
                tight.append((seed, kind, rooms, round(composed_m[seed], 3)))
    print(f"places    {len(times_s)} of {options.seeds}; failures: {failures or 'none'}")
    print(f"CPU time  median {statistics.median(times_s):.2f} s, longest {max(times_s):.2f} s")
    print(f"objects   median {statistics.median(objects):g}, {min(objects)} to {max(objects)}")
    print(f"poses     median {statistics.median(poses):g}, {min(poses)} to {max(poses)}")
    if composed_m:
        print(f"clearance {min(composed_m.values()):.3f} m in {len(composed_m)} composed scenes; below 0.3 m: {tight}")
    for name, count in classes.most_common():
        print(f"  {name:14} {count:5}  {count / len(times_s):5.2f} a place")
    if options.json:
        report = {"places": len(times_s), "failures": failures, "classes": dict(classes), "objects": objects}
        options.json.write_text(json.dumps({**report, "cpu_s": times_s, "poses": poses, "composed_m": composed_m}))


def _composed_room(place: Generated) -> float:
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "scene.glb")
        scene.write_bytes(compose(place.layout))
        geometry = load_scene(scene)
    return least_room(free_space(geometry, CARTER.z_min_m, CARTER.z_max_m, cell_m=0.02), place.trajectory_poses)


if __name__ == "__main__":
    main()
