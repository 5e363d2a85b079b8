"""Generated places to take pictures in: their scenes, lights, and the poses of cameras. Never a shipped environment."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from benchbot_scenes.scene import SceneGeometry

KINDS = ("apartment", "house", "office", "company")
LIGHTS: dict[str, dict[str, Any]] = {
    "day": {"time": "13:00", "lamps": {"on": "none"}},
    "evening": {"time": "18:30", "lamps": {"on": "all"}},
    "night": {"time": "23:00", "lamps": {"on": "all"}},
}
"""Names of lights to what they say of an environment's `lighting`."""
FEWEST_ROOMS, MOST_ROOMS = 2, 5
HALF_WIDTHS_DEG = (30.0, 48.0)
PITCH_SPREAD_DEG, HEIGHT_SPREAD_M = 4.0, 0.08


@dataclass(frozen=True)
class Place:
    """A place of a seed: its scene and the poses [qw, qx, qy, qz, x, y, z] of a way through all of it."""

    seed: int
    kind: str
    rooms: int
    scene: "SceneGeometry"
    way: NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """A camera: its optical frame in the map frame (4, 4), x right, y down, z forward, and its horizontal angle."""

    camera_to_map: NDArray[np.float64]
    width_deg: float


def furnish(seed: int, assets: str = "household") -> Place:
    """Generate the place of a seed, its kind and number of rooms drawn from it."""
    from benchbot_scenes.catalogue import pack
    from benchbot_scenes.generator.files import scene_of
    from benchbot_scenes.generator.generate import generate

    random = np.random.default_rng([seed, 0])
    kind = KINDS[int(random.integers(len(KINDS)))]
    rooms = int(random.integers(FEWEST_ROOMS, MOST_ROOMS + 1))
    place = generate(seed, kind, rooms, pack(assets))
    return Place(seed, kind, rooms, scene_of(place), np.array(place.trajectory_poses, np.float64))


def draw_views(place: Place, count: int) -> list[View]:
    """Draw cameras on the way through a place, which keeps clear of all obstacles, looking anywhere."""
    from benchbot_scenes.visibility import CARTER

    random = np.random.default_rng([place.seed, 1])
    views: list[View] = []
    for _ in range(count):
        at = random.uniform(0, len(place.way) - 1)
        first = min(int(at), len(place.way) - 2)
        x, y, z = place.way[first, 4:] + (at - first) * (place.way[first + 1, 4:] - place.way[first, 4:])
        eye_m = z + CARTER.eye_m + random.uniform(-HEIGHT_SPREAD_M, HEIGHT_SPREAD_M)
        yaw = random.uniform(-math.pi, math.pi)
        pitch = math.radians(random.uniform(-PITCH_SPREAD_DEG, PITCH_SPREAD_DEG))
        views.append(View(_looking((x, y, eye_m), yaw, pitch), 2 * random.uniform(*HALF_WIDTHS_DEG)))
    return views


def light_of(seed: int, lights: tuple[str, ...]) -> str:
    """Return the light that a place is seen in."""
    return lights[int(np.random.default_rng([seed, 2]).integers(len(lights)))]


def _looking(at: tuple[float, float, float], yaw: float, pitch: float) -> NDArray[np.float64]:
    forward = np.array([math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), -math.sin(pitch)])
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(forward, right), forward, np.array(at)], 1)
    return pose
