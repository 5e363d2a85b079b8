"""Formats of manipulation."""
