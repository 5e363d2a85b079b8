"""The format of exploration."""
