"""What lies around a run, as ROS 2 messages: the objects of the map that was handed in, and the walls of the place."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rosbags.typesys.stores.ros2_jazzy import builtin_interfaces__msg__Duration as Duration
from rosbags.typesys.stores.ros2_jazzy import builtin_interfaces__msg__Time as Time
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Point as Point
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Pose as RosPose
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Quaternion as Quaternion
from rosbags.typesys.stores.ros2_jazzy import geometry_msgs__msg__Vector3 as Vector3
from rosbags.typesys.stores.ros2_jazzy import nav_msgs__msg__MapMetaData as MapMetaData
from rosbags.typesys.stores.ros2_jazzy import nav_msgs__msg__OccupancyGrid as OccupancyGrid
from rosbags.typesys.stores.ros2_jazzy import sensor_msgs__msg__CompressedImage as CompressedImage
from rosbags.typesys.stores.ros2_jazzy import std_msgs__msg__ColorRGBA as ColorRGBA
from rosbags.typesys.stores.ros2_jazzy import visualization_msgs__msg__Marker as Marker
from rosbags.typesys.stores.ros2_jazzy import visualization_msgs__msg__MarkerArray as MarkerArray
from rosbags.typesys.stores.ros2_jazzy import visualization_msgs__msg__MeshFile as MeshFile

from benchbot.plugin import BenchbotError, Catalog, load_plugins, occupancy_map
from benchbot_record_mcap import messages

OBJECTS, MAP = "/objects", "/map"
FRAME = "map"
BOXES, NAMES = "boxes", "names"
"""The namespaces of markers: those of one object have the same id."""
_FREE, _OCCUPIED, _UNKNOWN = 0, 100, -1
_BOX, _NAME = ColorRGBA(0.47, 0.84, 1.0, 0.35), ColorRGBA(1.0, 1.0, 1.0, 1.0)
_LETTER_M = 0.12


def found_objects(results: Any, time_ns: int) -> MarkerArray | None:
    """Return an object map as markers: for each object a box and, above it, its likeliest class and how sure that is.

    None for results of another kind. The first marker deletes those of a map that was handed in before.
    """
    objects = results.get("objects") if isinstance(results, Mapping) else None
    if not isinstance(objects, Sequence):
        return None
    known = [item for item in objects if isinstance(item, Mapping) and {"centroid", "extent"} <= item.keys()]
    if objects and not known:
        return None
    names = results.get("class_list", ())
    made: list[Any] = [_marker(time_ns, "", 0, Marker.CUBE, (0.0,) * 3, (0.0,) * 3, _BOX, action=Marker.DELETEALL)]
    for number, item in enumerate(known):
        x, y, z = map(float, item["centroid"])
        width, depth, height = map(float, item["extent"])
        made.append(_marker(time_ns, BOXES, number, Marker.CUBE, (x, y, z), (width, depth, height), _BOX))
        above, size = (x, y, z + height / 2 + _LETTER_M), (0.0, 0.0, _LETTER_M)
        text = _likeliest(item.get("label_probs", ()), names)
        made.append(_marker(time_ns, NAMES, number, Marker.TEXT_VIEW_FACING, above, size, _NAME, text=text))
    return MarkerArray(made)


def walls(run: Mapping[str, Any], time_ns: int) -> OccupancyGrid | None:
    """Return the occupancy map of a run's last scene; None where there is none, or none that may be told.

    That of a hidden place is never told, nor that of a run with a secret: it is more than the solution was shown.
    """
    if run["selection"].get("commitment") is not None or not run["environments"]:
        return None
    scene = run["environments"][-1]
    found = Catalog(load_plugins()).find("environments", f"{scene['name']}:{scene['variant']}")
    if found is None or found.data.get("hidden"):
        return None
    try:
        plan = occupancy_map.read(occupancy_map.map_file(found.data, found.path.parent))
    except BenchbotError:
        return None
    x, y, yaw_rad = plan.origin_xyyaw
    cells = np.where(plan.occupied, _OCCUPIED, np.where(plan.free, _FREE, _UNKNOWN)).astype(np.int8)
    origin = RosPose(Point(x, y, 0.0), Quaternion(0.0, 0.0, float(np.sin(yaw_rad / 2)), float(np.cos(yaw_rad / 2))))
    rows, columns = cells.shape
    info = MapMetaData(Time(0, 0), plan.resolution_m, columns, rows, origin)
    # A message begins with the lowest row.
    return OccupancyGrid(messages.header(time_ns, FRAME), info, np.ascontiguousarray(cells[::-1]).reshape(-1))


def _likeliest(weights: Sequence[float], names: Sequence[str]) -> str:
    place = max(range(len(weights)), key=weights.__getitem__, default=len(names))
    return f"{names[place]} {weights[place]:.2f}" if place < len(names) else "object"


def _marker(
    time_ns: int,
    namespace: str,
    number: int,
    kind: int,
    place: tuple[float, ...],
    size: tuple[float, ...],
    color: ColorRGBA,
    *,
    text: str = "",
    action: int = Marker.ADD,
) -> Marker:
    nothing = np.zeros(0, np.uint8)
    return Marker(
        header=messages.header(time_ns, FRAME),
        ns=namespace,
        id=number,
        type=kind,
        action=action,
        pose=RosPose(Point(*place), Quaternion(0.0, 0.0, 0.0, 1.0)),
        scale=Vector3(*size),
        color=color,
        lifetime=Duration(0, 0),
        frame_locked=False,
        points=[],
        colors=[],
        texture_resource="",
        texture=CompressedImage(messages.header(0, ""), "", nothing),
        uv_coordinates=[],
        text=text,
        mesh_resource="",
        mesh_file=MeshFile("", nothing),
        mesh_use_embedded_materials=False,
    )
