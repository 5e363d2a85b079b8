"""The model of a scene that MuJoCo compiles: robot, floor, walls, posts of the footprint, fixed and loose objects."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from benchbot.simulation import Robot
from benchbot_scenes.obstacle_map import ObstacleMap
from benchbot_scenes.scene import Instance, SceneGeometry, only
from benchbot_sim_mujoco import base
from benchbot_sim_mujoco.arm import ArmDeclaration
from benchbot_sim_mujoco.base import FLOOR, HELD_BIT, LOOSE_BIT, POST_BIT

Floats = npt.NDArray[np.float64]

TIMESTEP_S = 0.0025
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
LARGEST_OBJECT_M2 = 6.0
OVERLAP_M = 0.01
"""Shapes that overlap by more where the scene begins, such as a chair under a table, do not collide with each other."""


def compiled(
    geometry: SceneGeometry,
    loose: Mapping[str, Instance],
    robot: Robot,
    floor_z_m: float,
    arm: ArmDeclaration | None,
) -> tuple[mujoco.MjModel, base.Wheels]:
    """Return the model of a scene, with a robot and objects of which some are loose, and the wheels of the robot.

    Bodies are `base`, `post NUMBER`, the loose objects by their names and the fixed ones as `held NAME`.
    """
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
    middles = centres(geometry, loose)
    for name, instance in loose.items():
        # At the middle of the object: about a point far away a fast turn would not be integrated well.
        body = spec.worldbody.add_body(name=name, pos=middles[name][0])
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


def centres(geometry: SceneGeometry, loose: Mapping[str, Instance]) -> dict[str, tuple[Floats, float]]:
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
        # A sheet has no hull: it is given a thickness, downwards where it lies.
        if extent_m.min() < THINNEST_PART_M:
            vertices = np.concatenate([vertices, vertices - THINNEST_PART_M * (extent_m == extent_m.min())])
        else:
            axes = np.linalg.svd(vertices - vertices.mean(0), full_matrices=False)[2]
            _, across_m, through_m = np.ptp(vertices @ axes.T, axis=0)
            if across_m < SMALLEST_PART_M:
                continue
            if through_m < THINNEST_PART_M:  # it is tilted, as a laptop's screen is
                vertices = np.concatenate([vertices, vertices - THINNEST_PART_M * axes[2] * np.sign(axes[2, 2] or 1.0)])
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
