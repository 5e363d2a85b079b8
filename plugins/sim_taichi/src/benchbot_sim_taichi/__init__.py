"""A ray-traced robot simulator for BenchBot, on CPU and GPU."""
