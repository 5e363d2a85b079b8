"""A robot declaration, read once into what the simulator needs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

from benchbot.plugin import BenchbotError, MotionConfig, Pose, did_you_mean
from benchbot.plugins.simulation.declared import mount, optional
from benchbot.plugins.simulation.dynamics import DriveLimits
from benchbot.plugins.simulation.imu import Imu
from benchbot.plugins.simulation.scanners import Laser, Lidar
from benchbot.plugins.simulation.sensors import Camera

INITIAL_POSE = "initial_pose"


@dataclass(frozen=True)
class Footprint:
    """A disc around the base's origin, that collides with everything between two heights above the floor."""

    radius_m: float
    z_min_m: float
    z_max_m: float

    def __post_init__(self) -> None:
        if not (self.radius_m > 0 and self.z_min_m < self.z_max_m):
            raise ValueError(f"{self} is empty")


@dataclass(frozen=True)
class Noise:
    """Standard deviations of odometry's relative errors per control tick, and their means."""

    linear: float
    angular: float
    linear_bias: float = 0.0
    angular_bias: float = 0.0

    def __post_init__(self) -> None:
        if not (self.linear >= 0 and self.angular >= 0):
            raise ValueError(f"{self} is negative")


@dataclass(frozen=True)
class Robot:
    """A simulated robot; `mounts` are poses of its frames in its base frame, `reported` are the frames in `poses`."""

    name: str
    global_frame: str
    base_frame: str
    reported: tuple[str, ...]
    mounts: dict[str, Pose]
    footprint: Footprint
    limits: DriveLimits
    noise: Noise
    camera: Camera
    laser: Laser
    lidar: Lidar | None = None
    imu: Imu | None = None

    @classmethod
    def from_declaration(cls, robot: Mapping[str, Any], motion: MotionConfig) -> Self:
        """Read a robot's declaration; raises BenchbotError saying what it lacks."""
        if "polygon" in robot.get("footprint", {}):
            raise BenchbotError(
                f"The robot '{robot.get('name')}' cannot be simulated.",
                "Its footprint has a polygon, and here a robot is a disc: it would touch what the robot does not.",
                "For simulation leave 'polygon' out of its footprint: radius_m is the disc that holds it.",
            )
        try:
            found = cls(
                name=str(robot["name"]),
                global_frame=str(robot["global_frame"]),
                base_frame=str(robot["robot_frame"]),
                reported=tuple(map(str, robot["poses"])),
                mounts={str(frame): mount(values) for frame, values in robot["frames"].items()},
                footprint=Footprint(**{key: float(value) for key, value in robot["footprint"].items()}),
                limits=DriveLimits.from_motion(motion),
                noise=Noise(**{key: float(value) for key, value in robot["noise"].items()}),
                camera=Camera.from_mapping(robot["camera"]),
                laser=Laser.from_mapping(robot["laser"]),
                lidar=optional(robot, "lidar", Lidar.from_mapping),
                imu=optional(robot, "imu", Imu.from_mapping),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise BenchbotError(
                f"The robot '{robot.get('name')}' cannot be simulated.",
                f"Its declaration lacks something, or has it in another form: {type(error).__name__}: {error}.",
                "Compare its footprint, noise, frames and sensors with: benchbot show robot carter_lidar",
            ) from error
        known = [found.base_frame, INITIAL_POSE, *found.mounts]
        mounted = tuple(sensor.frame for sensor in (found.camera, found.laser, found.lidar) if sensor)
        units = (found.imu.frame,) if found.imu and found.imu.frame != found.base_frame else ()
        for frame in (*found.reported, *mounted, *units):
            if frame not in (found.mounts if frame in (*mounted, *units) else known):
                raise BenchbotError(
                    f"The robot '{found.name}' has no frame '{frame}'.",
                    f"Known: {', '.join(known)}.{did_you_mean(frame, known)}",
                    "Name one of these, or add its place on the robot to 'frames' in the robot's declaration.",
                )
        return found

    def poses(self, base: Pose, initial: Pose, mounts: Mapping[str, Pose] | None = None) -> dict[str, Pose]:
        """Return the poses that the robot reports, by frame, for a pose of its base.

        `mounts` are where its frames are on it now, when other than declared.

        The camera's optical frame is there under the name 'camera' too, whatever the robot calls it.
        """
        frames = {self.base_frame: base, INITIAL_POSE: initial}
        frames |= {frame: base @ place for frame, place in (self.mounts if mounts is None else mounts).items()}
        return {frame: frames[frame] for frame in self.reported} | {"camera": frames[self.camera.frame]}
