"""Recordings of runs as films."""
