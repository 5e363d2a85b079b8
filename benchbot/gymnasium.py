"""BenchBot's tasks as Gymnasium environments, under their public name: importing it registers them."""

from benchbot.plugins.gymnasium import (
    Collision,
    Coverage,
    DiscreteMoves,
    MapQuality,
    Move,
    Reward,
    TaskEnv,
    Transition,
    Velocity,
    VelocityControl,
)

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
