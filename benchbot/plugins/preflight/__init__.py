"""Checks before the first episode: the solution, the scenes, the ground truth, the recorders and the disk."""
