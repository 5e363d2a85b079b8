"""Batches: many episodes, computed by workers that may die, in a folder that is the truth."""
