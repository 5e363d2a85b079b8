"""BenchBot's tasks as Gymnasium environments: importing this package registers them under `benchbot/…`."""

from typing import Any

try:
    import gymnasium
except ModuleNotFoundError as missing:
    from benchbot.core.errors import BenchbotError

    raise BenchbotError(
        "Gymnasium is not installed.",
        f"benchbot.gymnasium needs it: {missing}.",
        "Install it: pip install 'benchbot[gym]'",
    ) from missing

from benchbot.plugins.gymnasium.commands import Move

MOVES = (Move("move_distance", 0.25), Move("move_angle", 15.0), Move("move_angle", -15.0))
"""Ahead, left, right, as in most work on navigation by learning."""

_CARTER = {"robot": "carter_lowres"}
_SEGMENTATION = "active:ground_truth:segmentation"
_CHOICES: dict[str, dict[str, Any]] = {
    "benchbot/Task-v0": {},
    "benchbot/SemanticSlam-v0": {**_CARTER, "task": f"semantic_slam:{_SEGMENTATION}", "env": "miniroom:1"},
    "benchbot/SceneChange-v0": {**_CARTER, "task": f"scd:{_SEGMENTATION}"},
    "benchbot/Exploration-v0": {
        **_CARTER,
        "task": "exploration:active:ground_truth",
        "env": "miniroom:1",
        "reward": {"coverage": 1.0, "collision": 1.0},
        "moves": MOVES,
    },
    "benchbot/PointGoal-v0": {
        **_CARTER,
        "task": "navigation:point_goal:ground_truth",
        "env": "miniroom:1",
        "reward": {"point_goal": 1.0, "collision": 1.0},
        "moves": MOVES,
    },
}
_HORIZONS = {"benchbot/Exploration-v0": 100, "benchbot/PointGoal-v0": 500}
for _name, _choices in _CHOICES.items():
    gymnasium.register(
        _name,
        "benchbot.plugins.gymnasium.environment:TaskEnv",
        vector_entry_point="benchbot.plugins.gymnasium.make_vec:make",
        max_episode_steps=_HORIZONS.get(_name),
        kwargs=_choices,
    )
