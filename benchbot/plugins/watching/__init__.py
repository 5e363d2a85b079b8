"""Feeds and views of live runs and batches, for any display; nothing here draws anything."""

__all__ = ["batch_feed", "logs", "plain", "run_feed", "views"]
