"""What a change would do, one line per distribution, for people and for programs."""

import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from hashlib import sha256
from typing import Any

from benchbot.core import trust


class Action(StrEnum):
    """What happens to a distribution."""

    ADD = "add"
    UPGRADE = "upgrade"
    DOWNGRADE = "downgrade"
    REPLACE = "replace"
    REMOVE = "remove"


@dataclass(frozen=True)
class Change:
    """One distribution, or folder of v2's add-ons, that comes, changes or goes.

    `kind` is `plug-in`, `add-on` or `dependency`; `brings` is `declarations` or `code`, which `code` names. Nothing is
    known of what a removed one brings. `digest` is the SHA-256 of its content.
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
    def mark(self) -> str:
        """The hash that consent is remembered by: of its name and content."""
        return sha256(f"{self.name}\0{self.digest}".encode()).hexdigest()

    @property
    def needs_consent(self) -> bool:
        """Whether its code comes here, and the user has not said yet that it may."""
        return self.brings == "code" and self.kind != "add-on" and not trust.given(self.mark)

    def __str__(self) -> str:
        signs = {Action.ADD: "+", Action.REMOVE: "-"}
        versions = " -> ".join(filter(None, (self.old, self.new)))
        words = [f"{signs.get(self.action, '~')} {self.name} {versions}", self.kind]
        if self.brings == "declarations":
            words.append("declarations only")
        elif self.brings == "code":
            words.append(f"code: {', '.join(self.code)}" if self.kind != "dependency" and self.code else "code")
        if self.action is not Action.REMOVE and self.origin != "index":
            words.append(f"from {self.origin}")
        return f"{words[0]}  ({'; '.join(words[1:])})"


@dataclass(frozen=True)
class Plan:
    """All that a command would change."""

    changes: Sequence[Change] = field(default_factory=tuple)

    @property
    def unsure(self) -> list[Change]:
        """The changes that bring code which the user has not allowed yet."""
        return [change for change in self.changes if change.needs_consent]

    def as_dict(self, *, installer: str, done: bool) -> dict[str, Any]:
        """Return it as JSON: `{installer, done, changes: […]}`."""
        rows = [{**asdict(change), "trusted": not change.needs_consent} for change in self.changes]
        for row in rows:
            row["from"], row["to"], row["code"] = row.pop("old"), row.pop("new"), list(row["code"])
        return {"installer": installer, "done": done, "changes": rows}

    def __str__(self) -> str:
        return "\n".join(map(str, self.changes))


def action_of(old: str | None, new: str | None) -> Action:
    """Return what leads from one version to another."""
    if old is None or new is None:
        return Action.ADD if old is None else Action.REMOVE
    if old == new:
        return Action.REPLACE
    return Action.UPGRADE if _key(new) > _key(old) else Action.DOWNGRADE


def _key(version: str) -> list[tuple[int, int | str]]:
    """Order versions as far as a person would tell at a glance; installers know it exactly."""
    found = re.findall(r"\d+|[a-z]+", version.partition("+")[0].lower())
    # A pre-release (1.0rc1) is before its release, a post-release (1.0.post1) after it, and 1.0 before 1.0.1.
    kinds = {"post": 2}
    key: list[tuple[int, int | str]] = [
        (3, int(part)) if part.isdigit() else (kinds.get(part, 0), part) for part in found
    ]
    return [*key, (1, "")]
