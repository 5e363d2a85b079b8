"""Real robots for BenchBot, over ROS 2: a driver, and simulators as ROS 2 robots."""

__all__ = ["declaration", "instant", "localisation", "messages", "observing", "streams", "transforms"]
