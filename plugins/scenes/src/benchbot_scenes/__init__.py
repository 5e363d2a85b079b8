"""Scenes for BenchBot: read from files, furnished from layouts, generated from a seed, imported from any models."""
