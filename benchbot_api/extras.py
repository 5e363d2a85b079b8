"""The import name of BenchBot v2: an alias of `benchbot.api.tools.semantic_map`."""

from benchbot.api.tools.semantic_map import CLASS_TO_COLOR_MAP, get_bbox3d, vis_bbox3d, vis_semantic_map3d

__all__ = ["CLASS_TO_COLOR_MAP", "get_bbox3d", "vis_bbox3d", "vis_semantic_map3d"]
