"""Installs, upgrades and removes plug-ins: changes are shown first, and undone completely when anything fails."""

__all__ = ["lockfile"]
