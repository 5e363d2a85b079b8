"""Scenes as files of other simulators: `benchbot export`."""
