"""For viewers of results, under its public name: scores and explanations, maps, recorded frames, live runs and batches.

What it gives holds ground truth: it is for the host of a run.
"""

from benchbot.core.recording import RecordingNote
from benchbot.core.text import one_line, visible
from benchbot.evaluation.breakdown import breakdown
from benchbot.evaluation.evidence import Boxes, Camera, Scene, hidden, scene_of, views_of
from benchbot.evaluation.frames import Frame, frame_folders, numbered_frames
from benchbot.evaluation.score import Evaluation, method_for_task, score_files
from benchbot.plugins.batch.driver_lock import registered, registered_batches
from benchbot.plugins.batch.journal import Tail, sizes
from benchbot.plugins.drawing.map_model import Box, MapObject, MapPath, Occupancy, occupancy_of
from benchbot.plugins.drawing.palette import DARK, LIGHT, class_colors, ramp, to_hex
from benchbot.plugins.drawing.scene_maps import installed_map
from benchbot.plugins.report.diagnosis import BREAKDOWNS, ENDINGS, MEANINGS
from benchbot.plugins.report.episodes import ReportedEpisode, gather
from benchbot.plugins.watching.batch_feed import BatchFeed
from benchbot.plugins.watching.logs import end_of, line_of
from benchbot.plugins.watching.run_feed import RunFeed
from benchbot.plugins.watching.views import RunView
from benchbot.wire.run_state import RunState, live

__all__ = [
    "BREAKDOWNS",
    "DARK",
    "ENDINGS",
    "LIGHT",
    "MEANINGS",
    "BatchFeed",
    "Box",
    "Boxes",
    "Camera",
    "Evaluation",
    "Frame",
    "MapObject",
    "MapPath",
    "Occupancy",
    "RecordingNote",
    "ReportedEpisode",
    "RunFeed",
    "RunState",
    "RunView",
    "Scene",
    "Tail",
    "breakdown",
    "class_colors",
    "end_of",
    "frame_folders",
    "gather",
    "hidden",
    "installed_map",
    "line_of",
    "live",
    "method_for_task",
    "numbered_frames",
    "occupancy_of",
    "one_line",
    "ramp",
    "registered",
    "registered_batches",
    "scene_of",
    "score_files",
    "sizes",
    "to_hex",
    "views_of",
    "visible",
]
