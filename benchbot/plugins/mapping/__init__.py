"""The parts of mappers: points, boxes, voxels, planes, free floor, viewpoints; public as `benchbot.mapping`."""

__all__ = [
    "boxes",
    "changes",
    "drawing",
    "lens",
    "objects",
    "occupancy",
    "paths",
    "planes",
    "projection",
    "roaming",
    "viewpoints",
    "voxels",
]
