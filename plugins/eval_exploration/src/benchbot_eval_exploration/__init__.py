"""Exploration: how much of the floor a robot has seen; an evaluation method for BenchBot, with tasks to match."""
