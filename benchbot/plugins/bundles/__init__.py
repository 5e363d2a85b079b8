"""Results that others can check: bundled with the solution that made them, reproduced elsewhere, or replayed."""

__all__ = ["snapshot", "snapshot_store"]
