"""The changes that a command would make, found in distributions that are unpacked but not installed yet."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from hashlib import sha256
from pathlib import Path
from typing import Any

from packaging.version import InvalidVersion, Version

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.code_scan import code_in
from benchbot.plugins.installer.distributions import Distribution, found_in, origin_text, without_parents
from benchbot.plugins.installer.environment import Environment
from benchbot.plugins.v2 import trust

# Files that installers leave beside the distributions that they unpack.
_INSTALLER_LEFTOVERS = frozenset({".lock"})


class Action(StrEnum):
    """The kind of a change."""

    ADD = "add"
    UPGRADE = "upgrade"
    DOWNGRADE = "downgrade"
    REPLACE = "replace"
    REMOVE = "remove"


@dataclass(frozen=True)
class Change:
    """One distribution, or folder of v2's add-ons, that is installed, changed or removed.

    `kind` is `plug-in`, `add-on` or `dependency`; `brings` is `declarations` or `code`, which `code` names, or None for
    a removal. `digest` is the SHA-256 of its content.
    """

    name: str
    action: Action
    kind: str
    old: str | None
    new: str | None
    brings: str | None = None
    code: tuple[str, ...] = ()
    digest: str | None = None
    origin: str = "index"

    @property
    def consent_digest(self) -> str:
        """The hash of name and content that consent is stored under."""
        return sha256(f"{self.name}\0{self.digest}".encode()).hexdigest()

    @property
    def needs_consent(self) -> bool:
        """Whether it installs code that the user has not allowed yet."""
        return self.brings == "code" and self.kind != "add-on" and not trust.given(self.consent_digest)

    def __str__(self) -> str:
        signs = {Action.ADD: "+", Action.REMOVE: "-"}
        versions = " -> ".join(filter(None, (self.old, self.new)))
        notes = [self.kind]
        if self.brings == "declarations":
            notes.append("declarations only")
        elif self.brings == "code":
            notes.append(f"code: {', '.join(self.code)}" if self.kind != "dependency" and self.code else "code")
        if self.action is not Action.REMOVE and self.origin != "index":
            notes.append(f"from {self.origin}")
        return f"{signs.get(self.action, '~')} {self.name} {versions}  ({'; '.join(notes)})"


@dataclass(frozen=True)
class Plan:
    """All that a command would change."""

    changes: Sequence[Change]

    @property
    def without_consent(self) -> list[Change]:
        """The changes that install code which the user has not allowed yet."""
        return [change for change in self.changes if change.needs_consent]

    def as_dict(self, *, installer: str, done: bool) -> dict[str, Any]:
        """Return it as JSON: `{installer, done, changes: […]}`."""
        rows = [{**asdict(change), "trusted": not change.needs_consent} for change in self.changes]
        for row in rows:
            row["from"], row["to"], row["code"] = row.pop("old"), row.pop("new"), list(row["code"])
        return {"installer": installer, "done": done, "changes": rows}


def action_of(old: str | None, new: str | None) -> Action:
    """Return the action that leads from one version to another, where None is no version."""
    if old is None or new is None:
        return Action.ADD if old is None else Action.REMOVE
    try:
        if Version(old) != Version(new):
            return Action.UPGRADE if Version(new) > Version(old) else Action.DOWNGRADE
    except InvalidVersion:  # of an old distribution, from before PEP 440
        pass
    return Action.REPLACE


def unpacked(names: Collection[str], folder: Path) -> dict[str, Distribution]:
    """Return the distributions that are unpacked in a folder; raises BenchbotError if one is missing or damaged."""
    found = found_in([folder])
    missing = sorted(set(names) - found.keys())
    if missing:
        raise _damaged(f"{', '.join(missing)} did not come with the metadata of a distribution of that name.")
    listed = {without_parents(path) for one in found.values() for path in one.files}
    infos = {one.info.name for one in found.values()}
    others = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if not path.is_dir()} - listed
    unlisted = sorted(path for path in others - _INSTALLER_LEFTOVERS if path.partition("/")[0] not in infos)
    if unlisted:
        raise _damaged(f"It holds files that its RECORD does not name: {', '.join(unlisted[:5])}.")
    return found


def _damaged(why: str) -> BenchbotError:
    return BenchbotError("A wheel is damaged.", why, "Report it to who published it; nothing was changed.")


def change_of(staged: Distribution, installed: Distribution | None, origin: Mapping[str, Any] | None) -> Change:
    """Return the change that installing a staged distribution over the installed one would make."""
    code = code_in(staged)
    old = None if installed is None else installed.version
    return Change(
        staged.name,
        action_of(old, staged.version),
        "plug-in" if staged.is_plugin else "dependency",
        old,
        staged.version,
        "code" if code or not staged.is_plugin else "declarations",
        tuple(code),
        staged.content(),
        origin_text(origin),
    )


def refuse_overwriting(
    staged: Mapping[str, Distribution], installed: Mapping[str, Distribution], environment: Environment
) -> None:
    """Raise BenchbotError when a staged distribution would replace or hide files of a plug-in or of BenchBot."""
    others = [one for one in installed.values() if one.name not in staged and one.is_plugin]
    owners = {path: other.name for other in others for path in other.files}
    # An editable plug-in has no files here; a package of the same name would hide it.
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
