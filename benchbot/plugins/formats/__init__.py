"""Formats: object maps and their ground truths, with and without states; the occupancy maps of environments."""

__all__ = ["occupancy_map"]
