"""Figures of results for papers, by matplotlib: maps, trajectories and frames, as PNG, SVG or PDF."""
