"""The files that declarations name: the scene of each environment, and its ground truth where results are scored."""

from collections.abc import Iterator
from pathlib import Path

from benchbot.cli.kit.preflight import Intent
from benchbot.core.documents import REAL
from benchbot.plugin import BenchbotError, Catalog, Declaration, Finding, GroundTruths, Level, Pose, Scene

FILES = ("map_path", "occupancy_map")
"""The keys of an environment that name a file."""
_IN_MAP = {
    "occupied": "something stands there",
    "unknown": "nobody has been there when the map was made",
    "outside": "beyond its picture",
}


def scenes(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield what is found of each scene's files."""
    for scene in intent.scenes:
        missing = [(key, path) for key, path in _files(scene) if not path.is_file()]
        for key, path in missing:
            # Other simulators name scenes in a store of their own, such as /Game/Maps/house.
            yield Finding(
                Level.WARNING if str(scene.data[key]).startswith("/") else Level.BROKEN,
                f"A file of the environment '{scene.name}' is not there.",
                f"Its {key} is {scene.data[key]}: there is no {path}.",
                f"Correct {key} in {scene.path}, or choose another environment: benchbot list environments",
            )
        if not missing:
            yield Finding(Level.OK, "scene", scene.name)


def starts(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield whether a real environment's start, and its trajectory, are in the free space of its map."""
    for scene in intent.scenes:
        if scene.data["type"] != REAL or not ({"map_path", "occupancy_map"} & scene.data.keys()):
            continue
        from benchbot.evaluation import occupancy_map

        path = occupancy_map.map_file(scene.data, scene.path.parent)
        if not path.is_file():
            continue  # `scenes` tells it
        try:
            found = occupancy_map.read(path)
        except BenchbotError as error:
            yield Finding(Level.BROKEN, error.title, f"It is the map of '{scene.name}'. {error.why}", error.fix)
            continue
        placed = Scene(scene.data, scene.path.parent)
        poses = [("start_pose", placed.start_pose)]
        poses += [(f"trajectory_poses[{number}]", pose) for number, pose in enumerate(placed.trajectory)]
        blocked = [(key, pose, there) for key, pose in poses if (there := found.place(*_floor(pose))) != "free"]
        for key, pose, there in blocked:
            level = Level.BROKEN if key == "start_pose" else Level.WARNING
            x, y = _floor(pose)
            why = f"Its {key} is at ({x:.2f}, {y:.2f}) m, which is {there} in {path}: {_IN_MAP[there]}."
            fix = f"Correct {key} in {scene.path}, or the map's origin and resolution in {path}."
            yield Finding(level, f"The environment '{scene.name}' puts the robot where it cannot be.", why, fix)
        if not blocked:
            yield Finding(Level.OK, "start", f"{scene.name}: free in {path.name}")


def ground_truths(catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield whether there is what the method scores results of each scene against."""
    methods = catalog.plugins.pool("evaluators")
    if intent.method not in methods:
        return
    formats = methods[intent.method].value.ground_truth_formats
    if not formats:
        yield Finding(Level.OK, "ground truth", f"the method {intent.method} needs none")
        return
    truths = GroundTruths.of(catalog, None)
    for scene in intent.scenes:
        try:
            truths.find(scene.name, formats)
        except BenchbotError as error:
            fix = "Install the plug-in that provides it, choose another method, or leave --evaluate-with out."
            yield Finding(Level.BROKEN, error.title, f"The method '{intent.method}' needs it. {error.why}", fix)
        else:
            yield Finding(Level.OK, "ground truth", f"{scene.name}, for {intent.method}")


def _floor(pose: Pose) -> tuple[float, float]:
    x, y, _ = pose.translation_xyz
    return x, y


def _files(scene: Declaration) -> Iterator[tuple[str, Path]]:
    """Yield the keys and paths of a scene's files, but for those with a scheme, such as omniverse://…."""
    for key in FILES:
        name = scene.data.get(key)
        if name is not None and "://" not in name:
            yield key, (scene.path.parent / name).resolve()
