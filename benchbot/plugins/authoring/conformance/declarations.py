"""The conformance of declarations: tasks, robots and environments."""

import json
import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path

from benchbot.core.channels import ACTIONS, GIVEN_BY_EPISODES
from benchbot.core.declarations import formats, schema
from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.findings import Finding, Level
from benchbot.core.geometry import Pose
from benchbot.core.motion import MotionConfig
from benchbot.core.platform import Scene
from benchbot.core.plugin_manager import load
from benchbot.plugins.authoring.conformance.bench import SEED, Declared, find_declaration, make_bench
from benchbot.plugins.authoring.conformance.properties import Violation, check_properties, obtain

PICTURES = ("image_rgb", "image_depth", "image_segment")
FURTHEST_M = 10.0

Property = Callable[[Declaration, Catalog], str]


def check_task(task: Declared, *, catalog: Catalog | None = None) -> list[Finding]:
    """Return findings on a task: its declaration, its results format, its method, and the robots that can run it.

    `catalog` is what is installed, where that has been read already.
    """
    return _check("tasks", task, catalog, TASK)


def check_robot(robot: Declared, *, catalog: Catalog | None = None) -> list[Finding]:
    """Return findings on a robot's declaration; `check_simulator` checks what the robot does.

    `catalog` is what is installed, where that has been read already.
    """
    return _check("robots", robot, catalog, ROBOT)


def check_environment(
    environment: Declared,
    robot: Declared | None = None,
    cache_dir: Path | None = None,
    *,
    catalog: Catalog | None = None,
) -> list[Finding]:
    """Return findings on an environment: its declaration, files, poses and ground truth.

    With a `robot`, it is also put into the scene, in its simulator: does it stand there without touching anything?
    `catalog` is what is installed, where that has been read already.
    """
    findings = _check("environments", environment, catalog, ENVIRONMENT)
    if robot is not None and findings[0].level is Level.OK:
        findings += check_properties({"start": _is_free_at_the_start}, environment, robot, cache_dir)
    return findings


def _check(kind: str, declared: Declared, catalog: Catalog | None, properties: Mapping[str, Property]) -> list[Finding]:
    """Return the findings on a declaration: that of its schema alone where it cannot be read or is not valid."""
    known = catalog or Catalog(load())
    finding, found = obtain("declaration", lambda: find_declaration(kind, declared, known), lambda found: found.name)
    return [finding, *(one for declaration in found for one in check_properties(properties, declaration, known))]


def _is_described(declared: Declaration, catalog: Catalog) -> str:
    if not declared.data.get("description"):
        raise Violation("It has no description.", "Add a line 'description: …': people choose by it.", Level.WARNING)
    return str(declared.data["description"])


def _has_a_format(task: Declaration, catalog: Catalog) -> str:
    name = task.data.get("results_format")
    if name is None:
        return "none: results are what solutions make of them"
    declaration = catalog.get("formats", name)
    if "create" not in formats.functions(declaration):
        raise Violation(f"The format '{name}' has no function 'create'.", "Add one that returns an empty result.")
    created = formats.call(declaration, "create", [], {})
    try:
        json.dumps(created, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise Violation(f"What create() of '{name}' returns is not JSON: {error}.", "Return plain data.") from error
    formats.validate(declaration, created)
    return f"{name}: {', '.join(declaration.data['functions'])}"


def _can_be_scored(task: Declaration, catalog: Catalog) -> str:
    name, results = task.data.get("evaluation_method"), task.data.get("results_format")
    if name is not None:
        method = catalog.plugins.record("evaluators", name)
        if results not in method.result_formats:
            raise Violation(
                f"The method '{name}' does not read results of the format '{results}'.",
                f"Name a method that does; it reads {', '.join(sorted(method.result_formats))}.",
            )
        return str(name)
    methods = catalog.plugins.pool("evaluators")
    able = [known for known, method in methods.items() if results in method.value.result_formats]
    if results is not None and len(able) != 1:
        raise Violation(
            f"{'Several methods read' if able else 'No installed method reads'} the format '{results}'.",
            "Name one with 'evaluation_method: …'.",
            Level.WARNING,
        )
    return ", ".join(able) or "none"


def _has_episodes(task: Declaration, catalog: Catalog) -> str:
    name = task.data.get("episodes")
    if name is None:
        return "none: starts where the environment says"
    lists = [known for known in catalog.names("episodes") if known.startswith(f"{name}:")]
    if not lists:
        raise Violation(f"There is no list of episodes '{name}'.", "Install one, or yield it from benchbot_episodes.")
    return f"in {len(lists)} environments"


def _has_a_robot(task: Declaration, catalog: Catalog) -> str:
    wanted = {*task.data["actions"], *task.data["observations"]} - GIVEN_BY_EPISODES
    able = [name for name, robot in catalog.pool("robots").items() if wanted <= set(robot.data["connections"])]
    if not able:
        raise Violation(
            "No installed robot has all that it observes and does.",
            f"Install one that has {', '.join(sorted(wanted))}.",
            Level.WARNING,
        )
    return ", ".join(able)


def _has_a_platform(robot: Declaration, catalog: Catalog) -> str:
    kind = robot.data["type"]
    known = {*catalog.plugins.pool("simulators"), *catalog.plugins.pool("robot_drivers")}
    if kind not in known:
        raise Violation(
            f"Neither a simulator nor a driver is called '{kind}'.",
            f"Write the type of one that is installed: {', '.join(sorted(known)) or 'none is'}.",
        )
    return str(kind)


def _has_its_frames(robot: Declaration, catalog: Catalog) -> str:
    frame, poses = robot.data["robot_frame"], robot.data["poses"]
    if frame not in poses:
        raise Violation(f"poses lacks the robot's own frame '{frame}'.", f"Add '{frame}' to poses.")
    if "initial_pose" not in poses:
        fix = "Add 'initial_pose' to poses: solutions of v2 use it."
        raise Violation("poses lacks 'initial_pose'.", fix, Level.WARNING)
    return ", ".join(poses)


def _has_the_right_connections(robot: Declaration, catalog: Catalog) -> str:
    connections = robot.data["connections"]
    for name, connection in connections.items():
        direction = connection["connection"]
        if (direction == "api_to_ros") != (name in ACTIONS):
            raise Violation(
                f"'{name}' is connected by '{direction}'.",
                "Actions are api_to_ros, observations ros_to_api or roscache_to_api.",
            )
    offered = [name for name in ACTIONS if name in connections]
    if not offered:
        raise Violation("It offers no action.", f"Connect some of {', '.join(ACTIONS)}.", Level.WARNING)
    return f"{len(connections)}, with {', '.join(offered)}"


def _has_camera_models(robot: Declaration, catalog: Catalog) -> str:
    connections = robot.data["connections"]
    lacking = [name for name in PICTURES if name in connections and f"{name}_info" not in connections]
    if lacking:
        raise Violation(
            f"{', '.join(lacking)} comes without a camera model.",
            f"Connect {', '.join(f'{name}_info' for name in lacking)}: pictures are of little use without.",
            Level.WARNING,
        )
    return "one for each picture"


def _has_sensible_limits(robot: Declaration, catalog: Catalog) -> str:
    config = MotionConfig.from_robot(robot.data, "ground_truth")
    low_mps, high_mps = config.linear_limits_mps
    if not low_mps <= 0 < high_mps:
        raise Violation(
            f"linear_mps is [{low_mps:g}, {high_mps:g}].", "Write [backwards, forwards] in m/s, such as [-0.6, 1.5]."
        )
    if config.angular_limit_radps > 2 * math.pi:
        raise Violation(
            f"angular_radps is {config.angular_limit_radps:g}, more than a turn per second.",
            "Write radians per second, not degrees.",
            Level.WARNING,
        )
    return f"{low_mps:g} to {high_mps:g} m/s, {config.angular_limit_radps:g} rad/s"


def _has_robots(environment: Declaration, catalog: Catalog) -> str:
    kind = environment.data["type"]
    robots = catalog.pool("robots")
    able = [name for name, robot in robots.items() if kind in robot.data.get("runs_in", [robot.data["type"]])]
    missing = [name for name in environment.data.get("robots", ()) if name not in robots]
    if missing:
        raise Violation(
            f"It names the robots {', '.join(missing)}, which are not installed.", "Mend their names.", Level.WARNING
        )
    if not able:
        raise Violation(
            f"No installed robot can be in an environment of type '{kind}'.", "Mend the type.", Level.WARNING
        )
    return f"{kind}, for {', '.join(able)}"


def _has_its_files(environment: Declaration, catalog: Catalog) -> str:
    named = {key: environment.data[key] for key in ("map_path", "occupancy_map") if key in environment.data}
    paths = {key: environment.path.parent / name for key, name in named.items()}
    for key, path in paths.items():
        if not path.is_file():
            raise Violation(f"{key} is '{named[key]}', and there is no file {path}.", "Write it relative to this file.")
    return ", ".join(path.name for path in paths.values()) or "none"


def _starts_upright(environment: Declaration, catalog: Catalog) -> str:
    for name, values in _poses(environment):
        norm = math.hypot(*values[:4])
        if abs(norm - 1) > 1e-3:
            raise Violation(
                f"The quaternion of {name} has the norm {norm:.4g}.",
                "Write qw, qx, qy, qz, x, y, z: a unit quaternion first.",
            )
        roll_rad, pitch_rad, _ = Pose.from_wxyz_xyz(values).rpy_rad
        tilt_deg = math.degrees(max(abs(roll_rad), abs(pitch_rad)))
        if tilt_deg > 1:
            raise Violation(
                f"{name} tilts the robot by {tilt_deg:.3g} degrees.",
                "Write the quaternion as qw, qx, qy, qz; about z it is [cos, 0, 0, sin] of half the angle.",
            )
    x, y, _ = Scene(environment.data, environment.path.parent).start_pose.translation_xyz
    return f"({x:g}, {y:g}) m"


def _has_a_trajectory(environment: Declaration, catalog: Catalog) -> str:
    poses = _poses(environment)
    if len(poses) == 1:
        raise Violation("It has no trajectory.", "Add trajectory_poses, for tasks with move_next.", Level.WARNING)
    length_m = 0.0
    for (_, last), (name, values) in pairwise(poses):
        leg_m = math.dist(last[4:6], values[4:6])
        if leg_m > FURTHEST_M:
            raise Violation(
                f"{name} is {leg_m:.3g} m away from the one before.", "Give poses in metres, closer together."
            )
        length_m += leg_m
    return f"{len(poses) - 1} poses, {length_m:.3g} m"


def _has_a_valid_ground_truth(environment: Declaration, catalog: Catalog) -> str:
    names = []
    for path in catalog.ground_truth_files:
        document = schema.read(path)
        of = document.get("environment", {})
        if f"{of.get('name')}:{of.get('variant')}" == environment.name:
            schema.check(document, "ground_truth", path)
            names.append(str(document["format"]["name"]))
    if not names:
        fix = "Yield one from benchbot_ground_truths, for tasks that are scored with it."
        raise Violation("It has none.", fix, Level.WARNING)
    return ", ".join(sorted(names))


def _is_free_at_the_start(environment: Declared, robot: Declared, cache_dir: Path | None) -> str:
    kind = find_declaration("robots", robot).data["type"]
    bench = make_bench(load().record("simulators", kind).create, robot, environment, cache_dir=cache_dir)
    with bench.fresh() as platform:
        platform.load(bench.scene, SEED)
        platform.drive(0.0, 0.0, platform.control_period_s)
        if platform.collided or platform.contact_ahead(0.0, 0.0, 0.0):
            raise Violation(
                "The robot touches something at the start pose.", "Choose a start pose with room around it."
            )
    return f"free, for {bench.spec.robot['name']}"


def _poses(environment: Declaration) -> list[tuple[str, list[float]]]:
    """Return the start pose and the poses of the trajectory, each with its name and as [qw, qx, qy, qz, x, y, z]."""
    trajectory = enumerate(environment.data.get("trajectory_poses", ()), 1)
    return [("start_pose", environment.data["start_pose"]), *((f"trajectory pose {i}", pose) for i, pose in trajectory)]


TASK: dict[str, Property] = {
    "description": _is_described,
    "results format": _has_a_format,
    "evaluation": _can_be_scored,
    "episodes": _has_episodes,
    "robots": _has_a_robot,
}
ROBOT: dict[str, Property] = {
    "description": _is_described,
    "type": _has_a_platform,
    "frames": _has_its_frames,
    "connections": _has_the_right_connections,
    "camera models": _has_camera_models,
    "limits": _has_sensible_limits,
}
ENVIRONMENT: dict[str, Property] = {
    "description": _is_described,
    "type": _has_robots,
    "files": _has_its_files,
    "start pose": _starts_upright,
    "trajectory": _has_a_trajectory,
    "ground truth": _has_a_valid_ground_truth,
}
