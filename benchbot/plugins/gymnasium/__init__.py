"""BenchBot's tasks as Gymnasium environments: importing this package registers them under `benchbot/…`."""

try:
    import gymnasium
except ModuleNotFoundError as missing:
    from benchbot.core.errors import BenchbotError

    raise BenchbotError(
        "Gymnasium is not installed.",
        f"benchbot.gymnasium needs it: {missing}.",
        "Install it: pip install 'benchbot[gym]'",
    ) from missing

_CARTER = {"robot": "carter_lowres"}
_SEGMENTATION = "active:ground_truth:segmentation"
_CHOICES: dict[str, dict[str, str]] = {
    "benchbot/Task-v0": {},
    "benchbot/SemanticSlam-v0": {**_CARTER, "task": f"semantic_slam:{_SEGMENTATION}", "env": "miniroom:1"},
    "benchbot/SceneChange-v0": {**_CARTER, "task": f"scd:{_SEGMENTATION}"},
}
for _name, _choices in _CHOICES.items():
    gymnasium.register(
        _name,
        "benchbot.plugins.gymnasium.environment:TaskEnv",
        vector_entry_point="benchbot.plugins.gymnasium.vector:TaskVectorEnv",
        kwargs=_choices,
    )
