"""What a result says it ran, selected again on this machine, and how the software here differs from what it ran on."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from benchbot.core import plugin_manager
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.provenance import software
from benchbot.core.request import Limits, RunRequest
from benchbot.core.selection import Selection, select


@dataclass(frozen=True)
class Difference:
    """A piece of software that is not the one a result ran on: versions and content, None where there is none.

    Asset packs have no version.
    """

    name: str
    recorded: Mapping[str, Any] | None
    installed: Mapping[str, Any] | None

    @property
    def version(self) -> str | None:
        """The version that the result is of."""
        return None if self.recorded is None else self.recorded.get("version")

    @property
    def installed_version(self) -> str | None:
        """The version that is installed."""
        return None if self.installed is None else self.installed.get("version")

    def __str__(self) -> str:
        said = "did not use it" if self.recorded is None else f"is of {_text(self.recorded)}"
        here = "it is not installed" if self.installed is None else f"here it is {_text(self.installed)}"
        return f"{self.name}: the result {said}, {here}"


def again(provenance: Mapping[str, Any], catalog: Catalog, limits: Limits | None = None) -> Selection:
    """Return the selection that a result's provenance names; `limits` replace the task's.

    Raises BenchbotError when it is not possible here, when the result is of a real robot, and when the list that its
    episode is of has changed.
    """
    chosen = provenance["selection"]
    episode = chosen.get("episode")
    selection = select(
        catalog,
        RunRequest(
            task=str(chosen["task"]),
            robot=str(chosen["robot"]),
            environment=str(chosen["environment"]),
            seed=int(chosen["seed"]),
            episode=None if episode is None else int(episode["number"]),
            settings=chosen.get("settings") or {},
        ),
    )
    if selection.robot.data["type"] in plugin_manager.load().pool("robot_drivers"):
        raise BenchbotError(
            f"The result is of a real robot ('{selection.robot.name}').",
            "The world does not repeat itself: the same actions do not show the same again.",
            "Look at its recording, if there is one; results of simulated robots can be repeated.",
        )
    here = None if selection.episode is None else selection.episode.provenance()
    if here != episode:
        raise BenchbotError(
            "The list of episodes is not the one that the result is of.",
            f"The result is of {_episode(episode)}, here there is {_episode(here)}.",
            "Install the versions that its provenance names.",
        )
    return selection if limits is None else replace(selection, limits=limits)


def differences(provenance: Mapping[str, Any], selection: Selection) -> list[Difference]:
    """Return how the software that would run a selection here differs from that of a result, by name."""
    recorded, here = _named(provenance), _named(software(selection))
    names = sorted(name for name in {*recorded, *here} if recorded.get(name) != here.get(name))
    return [Difference(name, recorded.get(name), here.get(name)) for name in names]


def missing(provenance: Mapping[str, Any]) -> list[Difference]:
    """Return the distributions that a result ran on and that are not installed here."""
    found = []
    for name, used in sorted(provenance["plugins"].items()):
        if used["version"] != "v2" and not _is_installed(name):
            found.append(Difference(name, used, None))
    return found


def _is_installed(distribution: str) -> bool:
    try:
        version(distribution)
    except (PackageNotFoundError, ValueError):
        return False
    return True


def _named(used: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    packs = {f"asset pack {name}": pinned for name, pinned in used.get("assets", {}).items()}
    return {**used["plugins"], **packs}


def _text(pinned: Mapping[str, Any]) -> str:
    return " ".join(filter(None, [str(pinned.get("version", "")), f"(content {str(pinned['sha256'])[:8]})"]))


def _episode(chosen: Mapping[str, Any] | None) -> str:
    return "none" if chosen is None else f"{chosen['list']} (content {str(chosen['sha256'])[:8]})"
