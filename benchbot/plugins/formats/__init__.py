"""Formats of results and ground truths: object maps, with and without states."""

__all__ = ["object_map"]
