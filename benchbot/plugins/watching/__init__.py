"""Feeds and views of live runs and batches, for any display; nothing here draws anything."""

__all__ = ["batch_feed", "batch_list", "logs", "plain", "run_feed", "views"]
