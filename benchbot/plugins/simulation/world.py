"""The world of a kinematic simulator: all that it has to know of a loaded scene."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError, Pose
from benchbot.plugins.simulation.sensors import Camera, Frame, Instance


class World(ABC):
    """A loaded scene as sensors and footprints meet it; everything is in the map frame, in metres.

    `instances` are its objects. `revision` counts up when something has moved that a robot can bump into.
    """

    instances: Sequence[Instance] = ()
    revision: int = 0

    @abstractmethod
    def render(self, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> Sequence[Frame]:
        """Return a picture from each pose of the camera's optical frame; colours may be zeros without `rgb`."""

    @abstractmethod
    def raycast(
        self, origins: npt.NDArray[np.float64], directions: npt.NDArray[np.float64], range_max_m: float
    ) -> npt.NDArray[np.floating]:
        """Return distances (N,) along unit rays (N, 3) from origins (N, 3), +inf where nothing is within the range."""

    @abstractmethod
    def clearance_m(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest obstacle of the robot's footprint, +inf without any."""

    def render_many(self, camera: Camera, poses: Sequence[Pose], *, rgb: bool) -> Frame:
        """Return what `render` does as one frame, whose arrays have a first axis of poses."""
        frames = self.render(camera, poses, rgb=rgb)
        return Frame(*(np.stack([getattr(frame, each.name) for frame in frames]) for each in fields(Frame)))

    def clearances_m(self, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return `clearance_m` of points (N,)."""
        return np.array([self.clearance_m(*point) for point in zip(x.tolist(), y.tolist(), strict=True)], np.float64)

    def show_object(self, name: str, transform: npt.NDArray[np.floating]) -> None:
        """Put objects of a name, in pictures and rays, where a rigid transform (4, 4) takes them from where they began.

        For the pictures of what another simulator moves; raises BenchbotError where objects stay.
        """
        raise BenchbotError(
            f"The object '{name}' cannot be moved.",
            f"In pictures of {type(self).__name__} all objects stay where the scene has them.",
            "Leave objects fixed, or have another simulator take the pictures.",
        )

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point is inside an obstacle, for simulators whose clearance is not negative there."""
        return False
