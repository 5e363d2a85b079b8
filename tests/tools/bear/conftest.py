"""The committed environment, as the plug-in's own tests read it."""

from plugins.envs_bear.tests.conftest import environment, nodes, read_nodes, scene_path, truth

__all__ = ["environment", "nodes", "read_nodes", "scene_path", "truth"]
