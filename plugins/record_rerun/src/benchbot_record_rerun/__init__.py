"""Recordings of runs for the Rerun viewer."""
