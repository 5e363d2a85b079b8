"""Trajectory error (ATE, RPE): an evaluation method for BenchBot, with tasks to match."""
