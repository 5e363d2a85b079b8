"""Batches: many episodes, computed by workers that may die, in a folder that is the truth."""

__all__ = [
    "attempts",
    "counting",
    "driver",
    "driver_lock",
    "finalization",
    "folder",
    "journal",
    "machine",
    "plan",
    "seeds_screen",
    "status",
    "status_lines",
    "worker_pool",
]
