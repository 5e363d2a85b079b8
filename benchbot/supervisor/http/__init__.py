"""The HTTP server of a run and its routes (docs/wire.md)."""
