"""What it takes to make the plug-ins of an environment those of a lock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from benchbot.plugins.installer.distributions import Distribution
from benchbot.plugins.installer.lockfile import Locked
from benchbot.plugins.installer.staging import describe


@dataclass(frozen=True)
class Difference:
    """What is to be installed and removed, and notes on what is left alone."""

    sources: Sequence[str]
    remove: Sequence[str]
    notes: Sequence[str]


def difference(locked: Sequence[Locked], installed: Mapping[str, Distribution]) -> Difference:
    """Return what differs. A folder of sources that somebody works in stays as it is."""
    names = {one.name for one in locked}
    sources = [one.source for one in locked if not _is_here(one, installed.get(one.name))]
    others = [one for one in installed.values() if one.is_plugin and one.name not in names | {"benchbot"}]
    remove = [one.name for one in others if not one.is_editable]
    notes = [
        f"{one.name} is used from its folder of sources and stays, though it is not in the lock."
        for one in others
        if one.is_editable
    ]
    notes += [
        f"{one.name} is used from its folder of sources and stays, instead of version {one.version} of the lock."
        for one in locked
        if one.name in installed and installed[one.name].is_editable
    ]
    return Difference(sources, remove, notes)


def _is_here(locked: Locked, installed: Distribution | None) -> bool:
    if installed is None:
        return False
    same = installed.version == locked.version and describe(installed.origin) == locked.origin
    return same or installed.is_editable
