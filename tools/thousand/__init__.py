"""Freezes the thousand places: which seeds they are, and what these give."""
