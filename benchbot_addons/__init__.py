"""The import name of BenchBot v2's add-ons manager, for scripts that look things up in it."""

from benchbot_addons import manager

__all__ = ["manager"]
