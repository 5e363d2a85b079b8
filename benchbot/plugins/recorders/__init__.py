"""Recorders that ship in the box."""
