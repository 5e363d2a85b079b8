"""BenchBot's tasks as Gymnasium environments: importing this module registers them under `benchbot/…`."""

try:
    import gymnasium
except ModuleNotFoundError as missing:
    from benchbot.core.errors import BenchbotError

    raise BenchbotError(
        "Gymnasium is not installed.",
        f"benchbot.gymnasium needs it: {missing}.",
        "Install it: pip install 'benchbot[gym]'",
    ) from missing

from benchbot.plugins.gymnasium.commands import Move, Velocity
from benchbot.plugins.gymnasium.environment import TaskEnv
from benchbot.plugins.gymnasium.rewards import Collision, Coverage, MapQuality, Reward, Transition
from benchbot.plugins.gymnasium.wrappers import DiscreteMoves, VelocityControl

__all__ = [
    "Collision",
    "Coverage",
    "DiscreteMoves",
    "MapQuality",
    "Move",
    "Reward",
    "TaskEnv",
    "Transition",
    "Velocity",
    "VelocityControl",
]

_ENTRY_POINT = "benchbot.plugins.gymnasium.environment:TaskEnv"
_VECTOR_ENTRY_POINT = "benchbot.plugins.gymnasium.vector:TaskVectorEnv"
_ON_CARTER = {"robot": "carter_lowres"}

gymnasium.register("benchbot/Task-v0", _ENTRY_POINT, vector_entry_point=_VECTOR_ENTRY_POINT)
gymnasium.register(
    "benchbot/SemanticSlam-v0",
    _ENTRY_POINT,
    vector_entry_point=_VECTOR_ENTRY_POINT,
    kwargs={**_ON_CARTER, "task": "semantic_slam:active:ground_truth:segmentation", "env": "miniroom:1"},
)
gymnasium.register(
    "benchbot/SceneChange-v0",
    _ENTRY_POINT,
    vector_entry_point=_VECTOR_ENTRY_POINT,
    kwargs={**_ON_CARTER, "task": "scd:active:ground_truth:segmentation"},
)
