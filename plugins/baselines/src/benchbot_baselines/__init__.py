"""Labelled pictures of generated places."""
