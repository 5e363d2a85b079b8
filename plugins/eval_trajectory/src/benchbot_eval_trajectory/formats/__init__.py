"""The format of trajectories."""
