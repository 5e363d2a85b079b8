"""What would be installed, fetched and unpacked apart, so that it can be looked at before anything changes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.code_scan import code_in
from benchbot.plugins.installer.distributions import Distribution, found_in, placed
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.installer.installers import Pin
from benchbot.plugins.installer.plan import Change, action_of

# Files that unpacking leaves beside what it unpacks.
_OF_THE_INSTALLER = frozenset({".lock"})


@dataclass(frozen=True)
class Staged:
    """Pins, and the distributions that they unpack to, in the folder that they are in."""

    pins: Sequence[Pin]
    folder: Path

    @property
    def distributions(self) -> dict[str, Distribution]:
        """The unpacked distributions by name; raises BenchbotError when they are not what was asked for."""
        found = found_in([self.folder])
        missing = sorted({pin.name for pin in self.pins} - set(found))
        if missing:
            raise _damaged(f"{', '.join(missing)} did not come with the metadata of a distribution of that name.")
        listed = {placed(path) for one in found.values() for path in one.files}
        infos = {one.info.name for one in found.values()}
        actual = {path.relative_to(self.folder).as_posix() for path in self.folder.rglob("*") if not path.is_dir()}
        unlisted = sorted(path for path in actual - listed - _OF_THE_INSTALLER if path.partition("/")[0] not in infos)
        if unlisted:
            raise _damaged(f"It holds files that its RECORD does not name: {', '.join(unlisted[:5])}.")
        return found


def _damaged(why: str) -> BenchbotError:
    return BenchbotError("A wheel is damaged.", why, "Report it to who published it; nothing was changed.")


def changes(
    staged: Mapping[str, Distribution], installed: Mapping[str, Distribution], origins: Mapping[str, dict[str, Any]]
) -> list[Change]:
    """Return what installing the staged distributions over the installed ones would change."""
    found = []
    for name, distribution in sorted(staged.items()):
        code = code_in(distribution)
        old = installed.get(name)
        found.append(
            Change(
                name,
                action_of(None if old is None else old.version, distribution.version),
                "plug-in" if distribution.is_plugin else "dependency",
                None if old is None else old.version,
                distribution.version,
                "code" if code or not distribution.is_plugin else "declarations",
                tuple(code),
                distribution.content(),
                describe(origins.get(name)),
            )
        )
    return found


def describe(origin: Mapping[str, Any] | None) -> str:
    """Return where a distribution came from, in a word: `index`, or its address with the git commit."""
    if origin is None:
        return "index"
    commit = origin.get("vcs_info", {}).get("commit_id")
    url = str(origin["url"])
    return f"git+{url}@{commit}" if commit else url.removeprefix("file://")


def refuse_overwriting(
    staged: Mapping[str, Distribution], installed: Mapping[str, Distribution], environment: Environment
) -> None:
    """Raise BenchbotError when something would replace or hide files of a plug-in or of BenchBot."""
    others = [one for one in installed.values() if one.name not in staged and one.is_plugin]
    owners = {path: other.name for other in others for path in other.files}
    # What is used from a folder of sources has no files here; a package of its name would hide it.
    hidden = {name: other.name for other in others if other.is_editable for name in other.packages}
    for name, distribution in staged.items():
        for path in distribution.files:
            owner = hidden.get(path.partition("/")[0])
            if path in owners and (environment.site / path).is_file():
                owner = owners[path]
            if owner is not None:
                raise BenchbotError(
                    f"{name} would overwrite a file of {owner}.",
                    f"Both bring {path}.",
                    f"Report this to the author of {name}. Nothing was changed.",
                )
