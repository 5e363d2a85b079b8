"""Looking at what a robot observes and a solution maps: `ObservationVisualiser` and `semantic_map`. Needs matplotlib.

Importing this costs nothing: matplotlib is first imported when something is drawn, and chooses its own backend then.
"""

from benchbot.api.tools.observation_visualiser import SUPPORTED_OBSERVATIONS, ObservationVisualiser

__all__ = ["SUPPORTED_OBSERVATIONS", "ObservationVisualiser"]
