"""The import name of BenchBot v2: an alias of `benchbot.api.tools`."""

from benchbot.api.tools import SUPPORTED_OBSERVATIONS, ObservationVisualiser

__all__ = ["SUPPORTED_OBSERVATIONS", "ObservationVisualiser"]
