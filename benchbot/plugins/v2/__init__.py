"""BenchBot v2: its add-on folders, commands, and the routes of its client."""

__all__ = ["addons", "bridge", "migration", "official", "trust"]
