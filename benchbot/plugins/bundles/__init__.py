"""Results that others can check: bundled with the solution that made them, reproduced elsewhere, or replayed."""

__all__ = ["archive", "bundle_file", "snapshot", "snapshot_store", "solution_source"]
