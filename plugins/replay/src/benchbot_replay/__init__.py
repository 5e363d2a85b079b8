"""Recorded runs as robots of passive tasks."""
