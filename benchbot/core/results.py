"""Documents of results and of scores: created, checked, finished with provenance, written atomically and read."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from benchbot.core import atomic
from benchbot.core.declarations import formats, schema
from benchbot.core.declarations.catalog import Declaration
from benchbot.core.documents import Result, TrackedScene
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass

if TYPE_CHECKING:
    # Whoever only reads documents, such as a list of batches, needs none of the parts of a run.
    from benchbot.core.selection import Selection
    from benchbot.core.session import Session

VERSION = 1
SCORES_VERSION = 1
PUBLIC_ENVIRONMENT_KEYS = (
    "name",
    "variant",
    "type",
    "description",
    "robots",
    "start_pose",
    "trajectory_poses",
    "object_labels",
)
"""Keys of an environment that a solution and a result may hold: not its objects, nor where those are on disk."""


def empty_result(selection: "Selection") -> dict[str, Any]:
    """Return a result with v2's keys, its `results` created by the task's results format (or None without one)."""
    results = None
    if selection.results_format is not None:
        results = formats.call(selection.results_format, "create", [], {})
    return {**_details(selection), "results": results}


def _details(selection: "Selection") -> dict[str, Any]:
    scenes = [public_environment(scene) for scene in selection.environments]
    return {"task_details": dict(selection.task.data), "environment_details": scenes}


def public_environment(scene: Declaration) -> dict[str, Any]:
    """Return what a solution may know of an environment."""
    return {key: scene.data[key] for key in PUBLIC_ENVIRONMENT_KEYS if key in scene.data}


def finish(document: dict[str, Any], session: "Session", *, solution: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return a solution's result, checked and completed: version, task, scenes, provenance, track and actions.

    What a solution claims about these is replaced by what really ran and happened.
    Raises BenchbotError (failure `agent`) when `results` is missing or breaks the task's format.
    """
    results_format = session.selection.results_format
    refused = partial(BenchbotError, exit_code=ExitCode.SUBMISSION_FAILED, failure=FailureClass.AGENT)
    if "results" not in document:
        raise refused(
            "The result has no key 'results'.",
            f"It has: {', '.join(sorted(map(str, document))) or 'nothing'}.",
            "Start from BenchBot.empty_results() and fill in its 'results'.",
        )
    if results_format is not None:
        try:
            formats.validate(results_format, document["results"])
        except BenchbotError as error:
            title = f"The result breaks the format '{results_format.name}'."
            raise refused(title, f"{error.title} {error.why}", error.fix) from error
    return _complete(document, session, solution)


def failed(session: "Session", *, solution: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the result document of an episode that failed before there was a valid result, or ended without one."""
    return _complete({}, session, solution)


def _complete(document: dict[str, Any], session: "Session", solution: dict[str, Any] | None) -> dict[str, Any]:
    from benchbot.core import provenance

    completed = {
        **document,
        "version": VERSION,
        **_details(session.selection),
        "provenance": provenance.provenance(session, solution),
        "track": tracks(session),
        "actions": session.log.as_list(session.digest.marks()),
    }
    session.handed_in = True
    return completed


def tracks(session: "Session") -> list[TrackedScene]:
    """Return the true tracks of a session's scenes; none of a recording that does not know where the robot was."""
    from benchbot.core import provenance

    source = provenance.source_of_pose(session.selection)
    if source == "recording" and session.selection.localisation == "noisy":
        return []
    return [track.as_dict(source) for track in session.tracks]


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write a document atomically: a temporary file beside it, flushed to disk, then renamed over `path`.

    Raises BenchbotError when the disk is full or the folder is not writable; `path` is then as it was.
    """
    if path.exists() and not path.is_file():
        raise BenchbotError(
            f"Cannot write {path}.",
            "It is a folder or a device, and would be replaced by a file.",
            "Name a file.",
            failure=FailureClass.INFRASTRUCTURE,
        )
    try:
        text = json.dumps(document, indent=1, sort_keys=True, allow_nan=False) + "\n"
        atomic.write(path, text.encode())
    except OSError as error:
        raise atomic.cannot_write(path, error) from error
    except (TypeError, ValueError) as error:
        raise BenchbotError(
            f"Cannot write {path}.",
            f"The document holds something that is not JSON: {error}.",
            "Use only dicts, lists, strings, finite numbers, booleans and None; convert numpy values first.",
            failure=FailureClass.AGENT,
        ) from error


def read(path: Path) -> Result:
    """Return a result document, this version's or v2's; raises BenchbotError for one it does not know."""
    document = schema.read(path)
    version = document.get("version", VERSION)
    if version != VERSION:
        raise BenchbotError(
            f"{path} is a result of version {version!r}.",
            f"This BenchBot reads version {VERSION} and results of BenchBot v2.",
            "Upgrade BenchBot: pip install --upgrade benchbot",
        )
    schema.check(document, "result", path)
    return cast(Result, document)


def write_scores(path: Path, document: dict[str, Any]) -> None:
    """Write a scores document atomically; raises BenchbotError when it is not valid or cannot be written."""
    schema.check(document, "scores", path)
    write_json(path, document)


def read_scores(path: Path) -> dict[str, Any]:
    """Return a scores document; raises BenchbotError for one of a version or form that it does not know."""
    document = schema.read(path)
    version = document.get("version")
    if version != SCORES_VERSION:
        found = "no version" if version is None else f"version {version!r:.20}"
        raise BenchbotError(
            f"{path} is not a scores document that this BenchBot reads.",
            f"It has {found}; this BenchBot reads version {SCORES_VERSION}.",
            "Score the results again with: benchbot eval RESULT… -o scores.json",
        )
    schema.check(document, "scores", path)
    return document
