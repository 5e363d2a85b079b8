"""BenchBot's tasks as Gymnasium environments, under their public name: importing it registers them."""

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
