"""The official add-ons of BenchBot v2 (github.com/benchbot-addons), and the plug-ins that ship in their place."""

from collections.abc import Collection
from pathlib import Path
from typing import NamedTuple

ORGANISATION = "benchbot-addons"


class Replacement(NamedTuple):
    """The distributions that have what an official add-on had, and how that differs."""

    distributions: tuple[str, ...]
    differs: str = ""


_PLACES = Replacement(
    ("benchbot-envs-bear",),
    "the same places, built anew: develop objects have the published boxes, nothing looks as it did in v2",
)
_TRUTHS = Replacement(("benchbot-envs-bear",), "develop: the published figures; challenge: of places built anew")
_ROBOTS = Replacement(
    ("benchbot-sim-taichi",),
    "carter stops before contact and its odometry has no bias; carter_omni collides, with v2's bias",
)
_BATCHES = Replacement(("benchbot-envs-bear",))
_TASKS = Replacement(("benchbot-task-semslam",))
REPLACED = {
    "batches_bear": _BATCHES,
    "batches_isaac": _BATCHES,
    "batches_isaac_challenge": _BATCHES,
    "data_collect": Replacement(("benchbot-task-semslam", "benchbot-sim-taichi", "benchbot-envs-bear")),
    "envs_bear_challenge_sim_omni": _PLACES,
    "envs_bear_develop": _PLACES,
    "envs_bear_develop_sim_omni": _PLACES,
    "envs_isaac_challenge": _PLACES,
    "envs_isaac_develop": _PLACES,
    "eval_omq": Replacement(("benchbot-eval-omq",), "the same scores; results that made v2's fail are scored, or told"),
    "examples_base": Replacement(("benchbot",), "the same in purpose, and they save a map"),
    "formats_object_map": Replacement(("benchbot",), "stricter: what v2's let pass by mistake is told"),
    "ground_truths_bear_develop": _TRUTHS,
    "ground_truths_isaac": _TRUTHS,
    "ground_truths_isaac_develop": _TRUTHS,
    "robots_isaac": _ROBOTS,
    "robots_sim_omni": _ROBOTS,
    "ssu": Replacement(
        ("benchbot-task-semslam", "benchbot-sim-taichi", "benchbot-envs-bear", "benchbot-eval-omq"),
        "examples_ssu beside these is run from its folder",
    ),
    "tasks_data_collect": _TASKS,
    "tasks_ssu": _TASKS,
}
"""Official add-ons by the name of their repository."""


def repository(folder: Path, root: Path) -> str | None:
    """Return the official add-on that a folder below `root` belongs to, by name; None for any other.

    It is a folder of that name, `root` itself or below one that is called as the organisation.
    """
    for place in (folder, *folder.parents):
        if place.name in REPLACED and (place == root or place.parent.name == ORGANISATION):
            return place.name
        if place == root:
            break
    above = root.parent
    return above.name if above.name in REPLACED and above.parent.name == ORGANISATION else None


def replacement_of(name: str) -> Replacement | None:
    """Return what replaces the add-on `user/repository`, or its URL; None for one that is not official."""
    user, _, found = name.removesuffix("/").removesuffix(".git").rpartition("/")
    return REPLACED.get(found) if user.rpartition("/")[2] == ORGANISATION else None


def is_installed(name: str, distributions: Collection[str]) -> bool:
    """Say whether all that replaces an official add-on is among the distributions."""
    return set(REPLACED[name].distributions) <= {*distributions, "benchbot"}
