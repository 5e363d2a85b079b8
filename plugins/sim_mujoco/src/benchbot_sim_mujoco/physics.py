"""Contact physics of one robot in one scene: wheels on the floor, obstacles of the footprint, loose objects."""

from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from benchbot.plugin import BenchbotError, Pose
from benchbot.simulation import DriveLimits, Robot, State
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import Instance, SceneGeometry, only
from benchbot_sim_mujoco import base
from benchbot_sim_mujoco.arm import Arm, ArmDeclaration
from benchbot_sim_mujoco.base import FLOOR, FOOTPRINT, HELD_BIT, LOOSE_BIT, POST_BIT
from benchbot_sim_mujoco.drawing import Shape

Floats = npt.NDArray[np.float64]

# Warnings are looked for after each tick; MuJoCo itself would write a file into the current folder.
mujoco.set_mju_user_warning(lambda message: None)

TIMESTEP_S = 0.0025
SETTLING_S = 1.0
POSTS, POST_RADIUS_M, POST_REACH_M = 16, 0.01, 0.06
"""What the footprint can touch next, as posts: one for each sixteenth of the turn, where the nearest obstacle is."""
AWAY_M = 1000.0
WALL_EDGE_M = 0.1
WALL_HALF_WIDTH_M = 0.005
SECTION_M = (0.12, 0.125)
"""Where walls are cut for objects to bump into: above skirtings."""
DENSITY_KGPM3 = 150.0
"""Of a loose object's convex hull, which holds much air."""
SMALLEST_PART_M, THINNEST_PART_M = 0.01, 0.002
LIFTED_M, ARRANGING_S = 0.002, 0.5
"""Objects of an episode are let go a little above where they begin, and have so long to come to rest."""
LARGEST_OBJECT_M2 = 6.0
OVERLAP_M = 0.01
"""Shapes that overlap by more where the scene begins, such as a chair under a table, do not collide with each other."""
FALLEN_M = 0.05


class Physics:
    """The state of robot and loose objects. A step takes `TIMESTEP_S`; the same commands give the same bytes."""

    def __init__(
        self,
        geometry: SceneGeometry,
        loose: Mapping[str, Instance],
        obstacles: ObstacleMap,
        robot: Robot,
        floor_z_m: float,
        arm: ArmDeclaration | None = None,
    ) -> None:
        self._obstacles = obstacles
        self._robot = robot
        self._floor_z_m = floor_z_m
        self.loose = tuple(loose)
        self.model, self.wheels = _compiled(geometry, loose, robot, floor_z_m, arm)
        self._data = mujoco.MjData(self.model)
        self.arm = Arm(arm, self.model, self.loose) if arm else None
        self._centres = _centres(geometry, loose)
        self.energy_j = self.end_effector_path_m = 0.0
        self._footprint = self.model.geom(FOOTPRINT).id
        self._is_post = np.array([name.startswith("post") for name in self._geom_names()])
        self._settled: Floats | None = None

    def load(self, start: Pose, objects: Sequence[Mapping[str, Any]] = ()) -> None:
        """Put everything where the scene begins, at rest: the robot at a pose, objects where they came to rest.

        `objects` are those that begin elsewhere than the scene has them: `name`, `position` (of the middle of its box's
        bottom face), `turn_deg`. Raises BenchbotError for one that is not loose, or does not stay there.
        """
        if self._settled is None:
            self._settled = self._settle(start)
        self._reset()
        self._data.qpos[:] = self._settled
        self.place(start)
        if objects:
            self._arrange(objects)
        self.energy_j = self.end_effector_path_m = 0.0

    def place(self, pose: Pose) -> None:
        """Put the robot, at rest, at a pose; its wheels do not turn."""
        x, y, _ = pose.translation_xyz
        upright = self._data.qpos[:7] if self._settled is None else self._settled[:7]
        yaw_rad = base.planar(upright)[2]
        self._data.qpos[:7] = [x, y, upright[2], *base.turned(upright[3:7], pose.yaw_rad - yaw_rad)]
        self._data.qvel[:8] = 0.0
        self._command = (0.0, 0.0)
        self._gather_posts()
        mujoco.mj_forward(self.model, self._data)

    def advance(
        self,
        linear_mps: float,
        angular_radps: float,
        duration_s: float,
        limits: DriveLimits,
        told: Floats | None = None,
    ) -> bool:
        """Step through a control tick, ramping to the command; return whether the robot hit something.

        `told` (T, 7) are targets of the arm's servos in each step, the last one holds on. The footprint hits what it
        touches, the arm what it pushes hard; then it stays where it is.
        """
        target = limits.clipped(linear_mps, angular_radps)
        contact = False
        data, arm = self._data, self.arm
        steps = max(1, round(duration_s / TIMESTEP_S))
        tip = None if arm is None else data.site_xpos[arm.site].copy()
        for step in range(steps):
            if not contact:
                self._command = self._ramped(target, limits)
            data.ctrl[:2] = self.wheels.speeds_radps(*self._command)
            if arm is not None and told is not None:
                data.ctrl[arm.servos] = told[min(step, len(told) - 1)]
            self._gather_posts()
            mujoco.mj_step(self.model, data)
            if arm is not None:
                self.energy_j += arm.power_w(data) * TIMESTEP_S
                if arm.pushes(data):
                    contact, self._command = True, (0.0, 0.0)
                    data.ctrl[arm.servos[:-1]] = arm.joints(data)
                    told = None
            if self._touches():
                # The bumper gives: all of the impact is lost, and the robot stands still for the rest of the tick.
                contact, self._command = True, (0.0, 0.0)
                self._data.qvel[:8] = 0.0
        self._check()
        # What depends on positions is of the last but one step until now.
        mujoco.mj_kinematics(self.model, self._data)
        if arm is not None:
            self.end_effector_path_m += float(np.linalg.norm(data.site_xpos[arm.site] - tip))
        return contact

    @property
    def state(self) -> State:
        """Pose and velocity of the base, seen from above."""
        x, y, yaw_rad = base.planar(self._data.qpos)
        vx, vy = self._data.qvel[:2]
        # Linear velocities of a free joint are in the map frame, angular ones in the body's.
        return State(x, y, yaw_rad, float(vx * np.cos(yaw_rad) + vy * np.sin(yaw_rad)), float(self._data.qvel[5]))

    @property
    def pose(self) -> Pose:
        """The pose of the base in the map frame, as it rocks on its wheels."""
        x, y, z, qw, qx, qy, qz = (float(value) for value in self._data.qpos[:7])
        norm = float(np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz))
        return Pose((x, y, z), (qx / norm, qy / norm, qz / norm, qw / norm))

    @property
    def wheel_angles_rad(self) -> tuple[float, float]:
        """The angles by which the left and the right wheel have turned."""
        left, right = self._data.qpos[7:9]
        return float(left), float(right)

    def moved(self, name: str) -> tuple[Floats, Floats]:
        """Return translation (3,) and quaternion (4, w first) that take a loose object from where it began."""
        joint = self._data.joint(name)
        turned = np.empty(3)
        mujoco.mju_rotVecQuat(turned, self._centres[name][0], joint.qpos[3:7])
        return joint.qpos[:3] - turned, joint.qpos[3:7].copy()

    def centre(self, name: str) -> Pose:
        """Return the pose of the middle of an object's box, in the map frame; no rotation is how the scene has it."""
        x, y, z, qw, qx, qy, qz = (float(value) for value in self._data.joint(name).qpos)
        norm = float(np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz))
        return Pose((x, y, z), (qx / norm, qy / norm, qz / norm, qw / norm))

    @property
    def data(self) -> Any:
        """The state, for the arm to read."""
        return self._data

    def shapes(self) -> list[Shape]:
        """Return the parts of a robot with an arm, as they are now; none of a robot without, which nothing shows."""
        if self.arm is None:
            return []
        model, data = self.model, self._data
        root = model.body("base").id
        return [
            Shape(
                int(model.geom_type[geom]),
                model.geom_size[geom].copy(),
                model.geom_rgba[geom].copy(),
                data.geom_xpos[geom].copy(),
                data.geom_xmat[geom].copy(),
            )
            for geom in range(model.ngeom)
            if model.body_rootid[model.geom_bodyid[geom]] == root
        ]

    def transform(self, name: str) -> Floats:
        """Return the rigid transform (4, 4) that takes a loose object from where it began."""
        translation_m, quaternion = self.moved(name)
        matrix, rotation = np.eye(4), np.empty(9)
        mujoco.mju_quat2Mat(rotation, quaternion)
        matrix[:3, :3], matrix[:3, 3] = rotation.reshape(3, 3), translation_m
        return matrix

    def _geom_names(self) -> list[str]:
        return [self.model.geom(index).name for index in range(self.model.ngeom)]

    def _reset(self) -> None:
        mujoco.mj_resetData(self.model, self._data)
        if self.arm is not None:
            self.arm.home(self._data)

    def _arrange(self, objects: Sequence[Mapping[str, Any]]) -> None:
        """Put objects elsewhere and let them come to rest."""
        wanted: dict[str, Floats] = {}
        for entry in objects:
            name, position = str(entry["name"]), np.array(entry["position"], float)
            if name not in self.loose:
                raise BenchbotError(
                    f"The object '{name}' cannot begin elsewhere.",
                    f"It is not loose; these are: {', '.join(self.loose) or 'none'}.",
                    "Add it to options.loose of the environment, or leave it out of the episode's objects.",
                )
            _, height_m = self._centres[name]
            turn = np.zeros(4)
            half_rad = np.radians(float(entry.get("turn_deg", 0.0))) / 2
            turn[[0, 3]] = np.cos(half_rad), np.sin(half_rad)
            middle_m = position + np.array([0.0, 0.0, height_m / 2 + LIFTED_M])
            joint = self._data.joint(name)
            joint.qpos[:3], joint.qpos[3:] = middle_m, turn
            joint.qvel[:] = 0.0
            wanted[name] = middle_m
        for _ in range(round(ARRANGING_S / TIMESTEP_S)):
            mujoco.mj_step(self.model, self._data)
        for name, middle_m in wanted.items():
            moved_m = float(np.linalg.norm(np.array(self.centre(name).translation_xyz) - middle_m))
            if not moved_m < FALLEN_M:
                raise BenchbotError(
                    f"The object '{name}' does not stay where the episode begins.",
                    f"It moves by {moved_m:.2g} m within {ARRANGING_S:g} s: nothing is below, or something is there.",
                    "Mend its position in the episode's objects: the middle of its bottom, on top of something.",
                )
        self._data.qvel[:] = 0.0
        self._data.time = 0.0
        mujoco.mj_forward(self.model, self._data)

    def _settle(self, start: Pose) -> Floats:
        self._reset()
        self.place(start)
        for _ in range(round(SETTLING_S / TIMESTEP_S)):
            mujoco.mj_step(self.model, self._data)
        settled: Floats = self._data.qpos.copy()
        settled[:2] = start.translation_xyz[:2]
        settled[7:9] = 0.0
        for name in self.loose:
            moved_m = float(np.linalg.norm(self._data.body(name).xpos - self.model.body(name).pos))
            if not moved_m < FALLEN_M:
                raise BenchbotError(
                    f"The object '{name}' does not stay where it is when it is loose.",
                    f"It moves by {moved_m:.2g} m within {SETTLING_S:g} s: it hangs, leans, or lies inside of another.",
                    "Leave it out of options.loose: objects that stand on the floor or on a table can be loose.",
                )
        return settled

    def _check(self) -> None:
        """Raise BenchbotError where MuJoCo gave a warning: it begins anew by itself when values are not finite."""
        given = np.flatnonzero(self._data.warning.number)
        if len(given):
            stats = self._data.warning[int(given[0])]
            raise BenchbotError(
                "MuJoCo lost hold of this scene.",
                mujoco.mju_warningText(int(given[0]), stats.lastinfo),
                "Leave the objects that were touched last out of options.loose.",
            )

    def _ramped(self, target: tuple[float, float], limits: DriveLimits) -> tuple[float, float]:
        steps = (limits.linear_acceleration_mps2 * TIMESTEP_S, limits.angular_acceleration_radps2 * TIMESTEP_S)
        linear, angular = (
            now + min(max(wanted - now, -step), step)
            for now, wanted, step in zip(self._command, target, steps, strict=True)
        )
        return linear, angular

    def _gather_posts(self) -> None:
        """Put posts where obstacles are nearest to the footprint, the others away."""
        x, y, _ = base.planar(self._data.qpos)
        self._data.mocap_pos[:, 0] = AWAY_M + np.arange(POSTS)
        points, distances_m = self._obstacles.nearest_points(x, y)
        near = distances_m < self._robot.footprint.radius_m + POST_REACH_M
        if not near.any():
            return
        points, distances_m = points[near], distances_m[near]
        directions = points - (x, y)
        sectors = ((np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi) + 0.5) * POSTS).astype(int) % POSTS
        order = np.argsort(distances_m, kind="stable")
        used, first = np.unique(sectors[order], return_index=True)
        nearest = order[first]
        outwards = directions[nearest] / np.maximum(distances_m[nearest, None], 1e-9)
        self._data.mocap_pos[used, :2] = points[nearest] + POST_RADIUS_M * outwards

    def _touches(self) -> bool:
        contact = self._data.contact
        pairs = contact.geom[contact.dist < 0]
        return bool((self._is_post[pairs].any(1) & (pairs == self._footprint).any(1)).any())


def _compiled(
    geometry: SceneGeometry,
    loose: Mapping[str, Instance],
    robot: Robot,
    floor_z_m: float,
    arm: ArmDeclaration | None,
) -> tuple[mujoco.MjModel, base.Wheels]:
    spec = mujoco.MjSpec()
    spec.option.timestep = TIMESTEP_S
    # Explicit: friction is solved for the torque that the servos really apply.
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10
    deck_m = None if arm is None else arm.mount.translation_xyz[2]
    wheels = base.add_base(spec, robot.footprint, floor_z_m, deck_m)
    if arm is not None:
        arm.add(spec, spec.body("base"))
    # At the height of the centre of mass: what is touched higher up would tip the robot, which is a cylinder here.
    height_m = floor_z_m + float(np.clip(base.CENTRE_Z_M, robot.footprint.z_min_m, robot.footprint.z_max_m))
    for number in range(POSTS):
        post = spec.worldbody.add_body(name=f"post {number}", mocap=True, pos=[AWAY_M + number, 0, height_m])
        post.add_geom(
            name=f"post {number}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[POST_RADIUS_M, 0, 0],
            contype=POST_BIT,
            conaffinity=0,
            solref=base.BUMPER_SOLREF,
        )
    if not loose and arm is None:
        return spec.compile(), wheels
    centres = _centres(geometry, loose)
    for name, instance in loose.items():
        # At the middle of the object: about a point far away a fast turn would not be integrated well.
        body = spec.worldbody.add_body(name=name, pos=centres[name][0])
        body.add_freejoint(name=name)
        _add_hull(spec, body, name, geometry, instance, is_loose=True)
    held = {instance.name: instance for instance in geometry.instances if instance.name not in loose}
    building = {name: instance for name, instance in held.items() if _is_building(geometry, instance, arm)}
    for name, instance in held.items():
        if arm is not None and name not in building:
            _add_parts(spec, name, geometry, instance)
        elif name not in building:
            body = spec.worldbody.add_body(name=f"held {name}")
            _add_hull(spec, body, f"held {name}", geometry, instance, is_loose=False)
    _add_walls(spec, geometry, building, robot, floor_z_m)
    return _without_overlaps(spec, loose), wheels


def _is_building(geometry: SceneGeometry, instance: Instance, arm: ArmDeclaration | None) -> bool:
    """Return whether an object is walls and floors: it has no label; and where an arm could touch it, it is large."""
    if instance.class_name is not None:
        return False
    vertices = geometry.vertices[geometry.triangles[geometry.triangle_instance == instance.index]].reshape(-1, 3)
    return arm is None or not len(vertices) or float(np.ptp(vertices[:, :2], axis=0).prod()) > LARGEST_OBJECT_M2


def _centres(geometry: SceneGeometry, loose: Mapping[str, Instance]) -> dict[str, tuple[Floats, float]]:
    """Return the middle (3,) of the box of each object, where the scene has it, and its height."""
    found = {}
    for name, instance in loose.items():
        corners = geometry.vertices[geometry.triangles[geometry.triangle_instance == instance.index]].reshape(-1, 3)
        low, high = corners.min(0).astype(np.float64), corners.max(0).astype(np.float64)
        found[name] = ((low + high) / 2, float(high[2] - low[2]))
    return found


def _add_parts(spec: mujoco.MjSpec, name: str, geometry: SceneGeometry, instance: Instance) -> None:
    """Add a fixed object by the hulls of its connected parts: an arm can reach below a table top."""
    corners = geometry.vertices[geometry.triangles[geometry.triangle_instance == instance.index]].astype(np.float64)
    places, indices = np.unique(corners.reshape(-1, 3).round(4), axis=0, return_inverse=True)
    triangles = indices.reshape(-1, 3)
    edges = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    graph = coo_array((np.ones(len(edges)), edges.T), (len(places), len(places)))
    _, labels = connected_components(graph, directed=False)
    for part in np.unique(labels):
        vertices = places[labels == part]
        extent_m = np.ptp(vertices, axis=0)
        if np.sort(extent_m)[1] < SMALLEST_PART_M:
            continue
        if extent_m.min() < THINNEST_PART_M:
            # A sheet has no hull: it is given a thickness, downwards where it lies.
            vertices = np.concatenate([vertices, vertices - THINNEST_PART_M * (extent_m == extent_m.min())])
        mesh = spec.add_mesh(name=f"held {name} {part}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
        mesh.uservert = vertices.ravel().tolist()
        spec.worldbody.add_geom(
            name=f"held {name} {part}",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=f"held {name} {part}",
            contype=HELD_BIT,
            conaffinity=0,
            friction=[base.SLIDING_FRICTION, 0.005, 0.0001],
        )


def _add_hull(
    spec: mujoco.MjSpec, body: Any, name: str, geometry: SceneGeometry, instance: Instance, *, is_loose: bool
) -> None:
    vertices = np.unique(
        geometry.vertices[geometry.triangles[geometry.triangle_instance == instance.index]].reshape(-1, 3), axis=0
    )
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    mesh.uservert = (vertices.astype(np.float64) - body.pos).ravel().tolist()
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        density=DENSITY_KGPM3,
        contype=LOOSE_BIT if is_loose else HELD_BIT,
        conaffinity=LOOSE_BIT | HELD_BIT if is_loose else 0,
        friction=[base.SLIDING_FRICTION, 0.005, 0.0001],
    )


def _add_walls(
    spec: mujoco.MjSpec, geometry: SceneGeometry, building: Mapping[str, Instance], robot: Robot, floor_z_m: float
) -> None:
    """Add walls by the long edges of its section at one height, seen from above."""
    unlabelled = [instance.index for instance in building.values()]
    walls = only(geometry, np.isin(geometry.triangle_instance, unlabelled))
    footprint = robot.footprint
    low_m, high_m = floor_z_m + footprint.z_min_m, floor_z_m + footprint.z_max_m
    starts, ends = ObstacleMap(walls, floor_z_m + SECTION_M[0], floor_z_m + SECTION_M[1]).edges()
    for start, end in zip(starts, ends, strict=True):
        along = end - start
        length_m = float(np.hypot(*along))
        if length_m >= WALL_EDGE_M:
            half_rad = float(np.arctan2(along[1], along[0])) / 2
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=[length_m / 2, WALL_HALF_WIDTH_M, (high_m - low_m) / 2],
                pos=[*((start + end) / 2), (low_m + high_m) / 2],
                quat=[np.cos(half_rad), 0, 0, np.sin(half_rad)],
                contype=HELD_BIT,
                conaffinity=0,
            )


def _without_overlaps(spec: mujoco.MjSpec, loose: Mapping[str, Instance]) -> mujoco.MjModel:
    """Compile a model in which no loose object collides with what it overlaps in the beginning."""
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    excluded: set[tuple[str, str]] = set()
    for index in range(data.ncon):
        contact = data.contact[index]
        bodies = [model.body(model.geom_bodyid[geom]).name for geom in contact.geom]
        is_floor = FLOOR in (model.geom(geom).name for geom in contact.geom)
        if contact.dist < -OVERLAP_M and not is_floor and "base" not in bodies and not loose.keys().isdisjoint(bodies):
            excluded.add((bodies[0], bodies[1]))
    for one, other in sorted(excluded):
        spec.add_exclude(bodyname1=one, bodyname2=other)
    return spec.compile() if excluded else model
