"""BenchBot v2: its add-on folders as a source of declarations, and the routes of its client."""

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from benchbot.plugin import (
    Check,
    Command,
    DeclarationFolder,
    DeclarationSource,
    Routes,
    SubmissionMode,
    hookimpl,
    target,
)

_OPTIONS = ("--addons", "--trust-addons")
_HELP = """\
  --addons FOLDER  use the add-ons of BenchBot v2 in this folder, too; repeatable
  --trust-addons   let their Python code run, until it changes
"""


@hookimpl
def benchbot_declaration_sources() -> Iterator[DeclarationSource]:
    """Yield the folders of v2's add-ons."""
    yield DeclarationSource("v2", _folders, _installed, _take_options, _HELP)


@hookimpl
def benchbot_routes() -> Iterator[Routes]:
    """Yield the routes of v2's supervisor."""
    yield Routes("v2", "benchbot.plugins.v2.routes:routes")


@hookimpl
def benchbot_commands() -> Iterator[Command]:
    """Yield the command that looks at a folder of v2's add-ons."""
    yield Command(
        "migrate",
        "benchbot.plugins.v2.migrate_command:migrate",
        "Say what of a folder of BenchBot v2's add-ons will run here, what differs, and why.",
    )


@hookimpl
def benchbot_checks() -> Iterator[Check]:
    """Yield whether a solution would find the client that v2 published, without being led to the run."""
    yield Check("v2-client", target("benchbot.plugins.v2.client_check:check"))


@hookimpl
def benchbot_submission_modes() -> Iterator[SubmissionMode]:
    """Yield the submission mode of v2's client."""
    yield SubmissionMode(
        "v2-client", "benchbot.plugins.v2.client_mode", "All rights of its user; BenchBot v2's client finds the run."
    )


def _folders() -> Sequence[DeclarationFolder]:
    if not _in_use():
        return ()
    from benchbot.plugins.v2 import source

    return source.folders()


def _installed() -> Sequence[Mapping[str, str]]:
    if not _is_installed():
        return ()
    from benchbot.plugins.v2 import source

    return source.installed()


def _take_options(words: Sequence[str]) -> list[str]:
    if not _in_use() and not any(word.partition("=")[0] in _OPTIONS for word in words):
        return list(words)
    from benchbot.plugins.v2 import source

    return source.take_options(words)


def _in_use() -> bool:
    return bool(os.environ.get("BENCHBOT_ADDONS")) or _is_installed()


def _is_installed() -> bool:
    # As `addons.installed_folder`; most users have none, and `benchbot list` has no time to import more for them.
    return Path(sys.prefix, "share", "benchbot", "addons").is_dir()
