"""Recordings of runs as MCAP files with ROS 2 messages."""

__all__ = ["bag", "exact", "reading", "recording", "topics"]
