"""The parts that every mapper needs, for solutions: docs/mapping.md says how they are used, and in which frames.

Importing it imports NumPy; SciPy and Pillow are imported by what needs them.
"""

from benchbot.plugins.formats.object_map import CLASS_LIST, ObjectEntry, create_object
from benchbot.plugins.mapping.boxes import fuse, iou, non_maximum_suppression
from benchbot.plugins.mapping.changes import Views, changes, confirmed, describe_changes
from benchbot.plugins.mapping.drawing import draw_boxes
from benchbot.plugins.mapping.objects import MappedObject, ObjectMap, describe, merged, on_surfaces
from benchbot.plugins.mapping.occupancy import Cell, OccupancyGrid, Point
from benchbot.plugins.mapping.paths import first_corner, shortest_path
from benchbot.plugins.mapping.planes import floor_height_m, on_floor, on_walls
from benchbot.plugins.mapping.projection import (
    PointCloud,
    in_frame,
    in_map_frame,
    pixel_rays,
    planar,
    point_cloud,
    project,
    rotation_matrix,
    unproject,
)
from benchbot.plugins.mapping.roaming import Roamer
from benchbot.plugins.mapping.viewpoints import Sight, Viewpoint, best_viewpoint, look
from benchbot.plugins.mapping.voxels import VoxelMap, Voxels, clusters

__all__ = [
    "CLASS_LIST",
    "Cell",
    "MappedObject",
    "ObjectEntry",
    "ObjectMap",
    "OccupancyGrid",
    "Point",
    "PointCloud",
    "Roamer",
    "Sight",
    "Viewpoint",
    "Views",
    "VoxelMap",
    "Voxels",
    "best_viewpoint",
    "changes",
    "clusters",
    "confirmed",
    "create_object",
    "describe",
    "describe_changes",
    "draw_boxes",
    "first_corner",
    "floor_height_m",
    "fuse",
    "in_frame",
    "in_map_frame",
    "iou",
    "look",
    "merged",
    "non_maximum_suppression",
    "on_floor",
    "on_surfaces",
    "on_walls",
    "pixel_rays",
    "planar",
    "point_cloud",
    "project",
    "rotation_matrix",
    "shortest_path",
    "unproject",
]
