"""Feeds and views of live runs and batches, for any display; nothing here draws anything."""
