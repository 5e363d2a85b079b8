"""The check that what is replayed fits, and that a solution which is held does not see it beforehand."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchbot.cli.kit.holding import NATIVE
from benchbot.plugin import Catalog, Finding, Level
from benchbot_replay import source


def find(catalog: Catalog, intent: Any) -> Iterator[Finding]:
    """Yield a finding for each recording of another environment, and for each in the folder of a held solution."""
    for recorded in source.in_use():
        for scene in intent.scenes:
            if scene.name in recorded.environments:
                recorded.require_same(scene.name, scene.data)
    for submission in intent.submissions:
        if submission.mode == NATIVE:
            continue
        seen = Path(submission.options.get("folder", submission.spec.folder)).resolve()
        for path in source.named():
            if path.resolve().is_relative_to(seen):
                yield Finding(
                    Level.BROKEN,
                    "The solution could read what it is going to be shown.",
                    f"The recording {path} is in the folder that it sees, {seen}.",
                    "Move it out of that folder.",
                )
