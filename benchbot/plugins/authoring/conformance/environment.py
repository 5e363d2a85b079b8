"""The conformance of environments."""

import math
from functools import partial
from itertools import pairwise
from pathlib import Path

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot.core.platform import Scene
from benchbot.plugins.authoring.conformance.bench import SEED, Declared, Found, bench_of, find
from benchbot.plugins.authoring.conformance.properties import Wrong, look
from benchbot.plugins.authoring.conformance.task import describes_itself

FURTHEST_M = 10.0


def check_environment(
    environment: Declared,
    robot: Declared | None = None,
    cache_dir: Path | None = None,
    *,
    catalog: Catalog | None = None,
) -> list[Finding]:
    """Return what is right and wrong with an environment: its declaration, files, poses and ground truth.

    With a `robot`, it is also put into the scene, in its simulator: does it stand there without touching anything?
    `catalog` is what is installed, where that has been read already.
    """
    from benchbot.core.plugin_manager import load

    known = catalog or Catalog(load())
    found: list[Found] = []

    def declared() -> str:
        found.append(find("environments", environment, known))
        return f"{found[0].data['name']}:{found[0].data['variant']}"

    findings = [look("declaration", declared)]
    if found:
        properties = (
            ("description", describes_itself),
            ("type", partial(_has_a_robot, known)),
            ("files", _has_its_files),
            ("start pose", _starts_upright),
            ("trajectory", _goes_somewhere),
            ("ground truth", partial(_has_a_valid_truth, known)),
        )
        findings += [look(subject, partial(holds, found[0])) for subject, holds in properties]
        if robot is not None:
            findings.append(look("start", partial(_is_free_at_the_start, environment, robot, cache_dir)))
    return findings


def _has_a_robot(catalog: Catalog, found: Found) -> str:
    kind = found.data["type"]
    robots = catalog.pool("robots")
    able = [name for name, robot in robots.items() if kind in robot.data.get("runs_in", [robot.data["type"]])]
    missing = [name for name in found.data.get("robots", ()) if name not in robots]
    if missing:
        raise Wrong(
            f"It names the robots {', '.join(missing)}, which are not installed.", "Mend their names.", Level.WARNING
        )
    if not able:
        raise Wrong(f"No installed robot can be in an environment of type '{kind}'.", "Mend the type.", Level.WARNING)
    return f"{kind}, for {', '.join(able)}"


def _has_its_files(found: Found) -> str:
    named = {key: found.folder / found.data[key] for key in ("map_path", "occupancy_map") if key in found.data}
    for key, path in named.items():
        if not path.is_file():
            raise Wrong(
                f"{key} is '{found.data[key]}', and there is no file {path}.", "Write it relative to this file."
            )
    return ", ".join(path.name for path in named.values()) or "none"


def _starts_upright(found: Found) -> str:
    for name, values in (("start_pose", found.data["start_pose"]), *_trajectory(found)):
        norm = math.hypot(*values[:4])
        if abs(norm - 1) > 1e-3:
            raise Wrong(
                f"The quaternion of {name} has the norm {norm:.4g}.",
                "Write qw, qx, qy, qz, x, y, z: a unit quaternion first.",
            )
        roll_rad, pitch_rad, _ = Pose.from_wxyz_xyz(values).rpy_rad
        if max(abs(roll_rad), abs(pitch_rad)) > math.radians(1):
            raise Wrong(
                f"{name} tilts the robot by {math.degrees(max(abs(roll_rad), abs(pitch_rad))):.3g} degrees.",
                "Write the quaternion as qw, qx, qy, qz; about z it is [cos, 0, 0, sin] of half the angle.",
            )
    x, y, _ = Scene(found.data, found.folder).start_pose.translation_xyz
    return f"({x:g}, {y:g}) m"


def _goes_somewhere(found: Found) -> str:
    poses = [("start_pose", found.data["start_pose"]), *_trajectory(found)]
    if len(poses) == 1:
        raise Wrong("It has no trajectory.", "Add trajectory_poses, for tasks with move_next.", Level.WARNING)
    length_m = 0.0
    for (_, last), (name, values) in pairwise(poses):
        way_m = math.dist(last[4:6], values[4:6])
        if way_m > FURTHEST_M:
            raise Wrong(f"{name} is {way_m:.3g} m away from the one before.", "Give poses in metres, closer together.")
        length_m += way_m
    return f"{len(poses) - 1} poses, {length_m:.3g} m"


def _has_a_valid_truth(catalog: Catalog, found: Found) -> str:
    own = (str(found.data["name"]), str(found.data["variant"]))
    formats = []
    for path in catalog.ground_truth_files:
        document = schema.read(path)
        of = document.get("environment", {})
        if (str(of.get("name")), str(of.get("variant"))) == own:
            schema.check(document, "ground_truth", path)
            formats.append(str(document["format"]["name"]))
    if not formats:
        raise Wrong(
            "It has none.", "Yield one from benchbot_ground_truths, for tasks that are scored with it.", Level.WARNING
        )
    return ", ".join(sorted(formats))


def _is_free_at_the_start(environment: Declared, robot: Declared, cache_dir: Path | None) -> str:
    from benchbot.core.plugin_manager import load

    kind = find("robots", robot).data["type"]
    bench = bench_of(load().record("simulators", kind).create, robot, environment, cache_dir=cache_dir)
    with bench.fresh() as platform:
        platform.load(bench.scene, SEED)
        platform.drive(0.0, 0.0, platform.control_period_s)
        if platform.collided or platform.contact_ahead(0.0, 0.0, 0.0):
            raise Wrong("The robot touches something at the start pose.", "Choose a start pose with room around it.")
    return f"free, for {bench.spec.robot['name']}"


def _trajectory(found: Found) -> list[tuple[str, list[float]]]:
    return [
        (f"trajectory pose {number}", pose) for number, pose in enumerate(found.data.get("trajectory_poses", ()), 1)
    ]
