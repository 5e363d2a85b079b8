"""Declarations and documents as plug-ins read them: the types of what their schemas, which explain each key, accept."""

from collections.abc import Mapping
from typing import Any, NotRequired, TypedDict

Settings = Mapping[str, Any]
"""A mapping whose keys are up to the simulator, driver or format that reads it."""

REAL = "real"
"""The `type` of environments that are not simulated."""


class RobotDeclaration(TypedDict):
    """A robot; the keys of BenchBot v2 that nothing reads any more are left out."""

    name: str
    type: str
    global_frame: str
    robot_frame: str
    poses: list[str]
    connections: Mapping[str, Settings]
    description: NotRequired[str]
    runs_in: NotRequired[list[str]]
    speed_factor: NotRequired[float]
    stops_before_contact: NotRequired[bool]
    limits: NotRequired[Settings]
    tolerances: NotRequired[Mapping[str, float]]
    footprint: NotRequired[Settings]
    camera: NotRequired[Settings]
    laser: NotRequired[Settings]
    lidar: NotRequired[Settings]
    imu: NotRequired[Settings]
    arm: NotRequired[Settings]
    noise: NotRequired[Settings]
    frames: NotRequired[Mapping[str, Settings]]
    driver: NotRequired[Settings]
    fleet: NotRequired[Mapping[str, Settings]]
    address: NotRequired[str]
    replay: NotRequired[Mapping[str, Settings]]


class EnvironmentDeclaration(TypedDict):
    """A variant of an environment."""

    name: str
    variant: str | int
    type: str
    start_pose: list[float]
    description: NotRequired[str]
    map_path: NotRequired[str]
    occupancy_map: NotRequired[str]
    hidden: NotRequired[bool]
    assets: NotRequired[str]
    trajectory_poses: NotRequired[list[list[float]]]
    robots: NotRequired[list[str]]
    object_labels: NotRequired[list[str]]
    lighting: NotRequired[Settings]
    options: NotRequired[Settings]
    loose_objects: NotRequired[list[Settings]]


class GroundTruth(TypedDict):
    """The truth of one scene, in one format."""

    environment: Settings
    format: Settings
    ground_truth: Any


class TrackedScene(TypedDict):
    """The robot's path in one scene."""

    scene: str
    source: str
    path_length_m: float
    collisions: int
    columns: list[str]
    rows: list[list[Any]]
    objects: NotRequired[list[Mapping[str, Any]]]
    held: NotRequired[list[str]]
    energy_j: NotRequired[float]
    end_effector_path_m: NotRequired[float]


class Result(TypedDict):
    """A result, of this version or of BenchBot v2."""

    task_details: Settings
    environment_details: list[Settings]
    version: NotRequired[int]
    results: NotRequired[Any]
    track: NotRequired[list[TrackedScene]]
    actions: NotRequired[list[Settings] | None]
    provenance: NotRequired[Settings]
