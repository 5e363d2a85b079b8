"""Figures of results for papers, by matplotlib: maps, trajectories and frames, as PNG, SVG or PDF."""

__all__ = ["figures", "map_layout", "map_model", "palette", "scene_maps"]
