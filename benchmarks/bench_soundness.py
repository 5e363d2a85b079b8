"""Whether places are sound: the 25 that ship, generated ones, the thousand; every violation is counted by its kind.

python -m benchmarks soundness [--seeds 200] [--first 5000] [--processes 2] [--only KIND] [--list] [--json FILE]

Of every place all objects are looked at, in the composed scene: see `benchbot_scenes.violations`. Objects whose boxes
are published (those of the twins house and miniroom) are counted apart, since they stand where they were published.
Of generated places means are told, too: of floor, room to move, objects, classes, and the processor time to make one.
"""

import argparse
import json
import math
import os
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot_envs_thousand.making import places
from benchbot_scenes.catalogue import pack
from benchbot_scenes.compose import compose
from benchbot_scenes.differences import furnished
from benchbot_scenes.free_space import free_space
from benchbot_scenes.generator.generate import Generated, generate
from benchbot_scenes.generator.kinds import KINDS
from benchbot_scenes.generator.proxy import class_counts
from benchbot_scenes.gltf import load_scene
from benchbot_scenes.layout import Layout, read_layout
from benchbot_scenes.scene import SceneGeometry
from benchbot_scenes.violations import Violation, driving_violations, placing_violations
from benchbot_scenes.visibility import CARTER

MOST_ROOMS = 8
BEAR = Path(str(files("benchbot_envs_bear")))


@dataclass(frozen=True)
class Checked:
    """A place: the number of its objects, what is wrong with it, and which of that is so in published boxes."""

    name: str
    objects: int
    violations: tuple[Violation, ...]
    published: tuple[Violation, ...] = ()
    failure: str = ""
    cpu_s: float = 0.0
    counted: Mapping[str, float] = field(default_factory=dict)
    classes: Mapping[str, int] = field(default_factory=dict)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--first", type=int, default=5000)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--only", choices=("shipped", "generated", "thousand"), help="leave out the others")
    parser.add_argument("--list", action="store_true", help="tell every violation")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    report = {}
    with ProcessPoolExecutor(options.processes) as workers:
        shipped = sorted(path.stem for path in (BEAR / "environments").glob("*.yaml"))
        seeds = range(options.first, options.first + options.seeds)
        kinds: list[tuple[str, Callable[[Any], Checked], Collection[Any]]] = [
            ("shipped", check_shipped, shipped),
            ("generated", check_generated, seeds),
            ("thousand", check_thousand, places()),
        ]
        for title, check, items in kinds:
            # The thousand only where they are asked for: they take an hour and more of a processor.
            if title == options.only or (options.only is None and title != "thousand"):
                found = list(workers.map(check, items))
                tell(title, found, every=options.list)
                report[title] = [asdict(place) for place in found]
    if options.json:
        options.json.write_text(json.dumps(report))


def check_shipped(stem: str) -> Checked:
    """Check one of the 25 environments; a finished scene only for its trajectory."""
    started = time.process_time()
    environment = schema.read(BEAR / "environments" / f"{stem}.yaml")
    path = BEAR / "environments" / environment["map_path"]
    layout = None if path.suffix == ".glb" else read_layout(path)
    geometry = load_scene(path) if layout is None else _composed(layout)
    found = [] if layout is None else placing_violations(layout, geometry)
    found += driving_violations(geometry, environment["trajectory_poses"])
    published = BEAR / "published" / f"{stem}.json"
    named = {entry["id"] for entry in schema.read(published)["objects"]} if published.is_file() else set()
    theirs = [it for it in found if (it.kind == "tight" and named) or {it.name, it.other or it.name} <= named]
    count = len(geometry.instances) if layout is None else len(furnished(layout).objects)
    ours = [it for it in found if it not in theirs]
    return Checked(stem, count, tuple(ours), tuple(theirs), cpu_s=time.process_time() - started)


def check_generated(seed: int) -> Checked:
    """Check the place of a seed."""
    return checked(seed, *kind_and_rooms(seed))


def check_thousand(variant: int) -> Checked:
    """Check one of the thousand."""
    place = places()[variant]
    return checked(place.seed, place.kind, place.rooms)


def kind_and_rooms(number: int) -> tuple[str, int]:
    """Return the kind and the number of rooms of a place; they take turns."""
    kinds = list(KINDS)
    return kinds[number % len(kinds)], 1 + number // len(kinds) % MOST_ROOMS


def checked(seed: int, kind: str, rooms: int) -> Checked:
    """Generate a place, and check it."""
    started_s = time.process_time()
    name = f"{kind} of {rooms}, seed {seed}"
    try:
        made = generate(seed, kind, rooms, pack("household"))
    except BenchbotError as error:
        return Checked(name, 0, (), failure=error.title)
    return examined(name, made, _composed(made.layout), started_s)


def examined(name: str, made: Generated, geometry: SceneGeometry, started_s: float) -> Checked:
    """Check a place that was made since `started_s`, by this process's clock."""
    making_s = time.process_time() - started_s
    found = placing_violations(made.layout, geometry) + driving_violations(geometry, made.trajectory_poses)
    cpu_s = time.process_time() - started_s
    space = free_space(geometry, CARTER.z_min_m, CARTER.z_max_m)
    reached = space.region(made.start_pose[4:6], CARTER.radius_m)
    counted = {
        "rooms": len(made.plan.spaces),
        "floor m²": sum(math.prod(np.subtract(room.high, room.low)) for room in made.plan.spaces),
        "room to move m²": float(reached.sum()) * space.cell_m**2,
        "objects": len(made.items),
        "labelled objects": sum(class_counts(made.items).values()),
        "models": len({item.model.id for item in made.items}),
        "files of models": len({item.model.file for item in made.items}),
        "poses": len(made.trajectory_poses),
        "processor seconds to make": making_s,
    }
    return Checked(name, len(made.items), tuple(found), (), "", cpu_s, counted, class_counts(made.items))


def _composed(layout: Layout) -> SceneGeometry:
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder, "scene.glb")
        scene.write_bytes(compose(layout))
        return load_scene(scene)


def tell(title: str, places: list[Checked], *, every: bool = False) -> None:
    """Print the violations, means of what is counted, and the classes."""
    objects = sum(place.objects for place in places)
    kinds = Counter(found.kind for place in places for found in place.violations)
    published = Counter(found.kind for place in places for found in place.published)
    failed = [place for place in places if place.failure]
    count, cpu_s = sum(kinds.values()), sum(place.cpu_s for place in places)
    print(f"{title}: {len(places)} places, {len(failed)} failed, {objects} objects, {cpu_s:.0f} s of CPU")
    print(f"  violations {count}, {1000 * count / max(1, objects):.2f} of 1,000: {dict(kinds)}")
    if published:
        print(f"  in published boxes {sum(published.values())}: {dict(published)}")
    for place in places:
        for found in place.violations if every else ():
            print(f"    {place.name}: {found.kind} {found.name} {found.other} {found.figure}")
        if place.failure:
            print(f"    {place.name}: {place.failure}")
    made = [place for place in places if place.counted]
    if not made:
        return
    for key in made[0].counted:
        values = [place.counted[key] for place in made]
        print(f"  {key}: mean {np.mean(values):.1f}, {min(values):.1f} to {max(values):.1f}")
    rooms = sum(place.counted["rooms"] for place in made)
    print(f"  objects per room: {sum(place.objects for place in made) / rooms:.1f}")
    classes: Counter[str] = Counter()
    for place in made:
        classes.update(place.classes)
    print("  classes: " + ", ".join(f"{name} {count}" for name, count in classes.most_common()))


if __name__ == "__main__":
    main()
