"""The end of a batch that nobody looks on at: whoever is there evaluates it, once, under a claim like an episode's."""

import json
import time
from contextlib import suppress
from hashlib import sha256

from benchbot.core import results
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.core.request import digest
from benchbot.plugins.batch.claims import HeldClaim, Observer
from benchbot.plugins.batch.events import EventLog
from benchbot.plugins.batch.finishing import finish
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.heartbeat import Heartbeat
from benchbot.plugins.batch.plan import Plan
from benchbot.plugins.batch.worker_pool import Crew

CLAIM = "conclusion"
POLL_S = 0.5


def conclude(folder: Folder, plan: Plan, catalog: Catalog, who: str, *, patient: bool = False) -> None:
    """Evaluate a finished batch, unless that was done, or somebody else does it just now.

    What came of it is in `conclusion.json`: `files` that were made, or the `problem` why there are none. Who is
    `patient` returns when it is there. Raises OSError, and BenchbotError when it cannot be written.
    """
    crew = Crew.read(folder)
    evaluated = _evaluated(folder, plan, archive=crew.archive)
    observer = Observer(folder.claims, plan.policy.stale_s)
    while not _is_concluded(folder, evaluated):
        claim = HeldClaim.take(folder.claims / CLAIM, who)
        if claim is not None:
            try:
                with Heartbeat(claim, plan.policy.stale_s):
                    if not _is_concluded(folder, evaluated):
                        _evaluate(folder, plan, catalog, who, evaluated, archive=crew.archive)
            finally:
                claim.release()
        elif observer.is_stale(CLAIM):
            observer.steal(CLAIM)
        elif patient:
            time.sleep(POLL_S)
        else:
            return


def _evaluate(folder: Folder, plan: Plan, catalog: Catalog, who: str, evaluated: str, *, archive: bool) -> None:
    events = EventLog(folder.events, who)
    events.tell("evaluating")
    try:
        said: dict[str, object] = {"files": finish(folder, plan, catalog, archive=archive).as_dict()}
    except BenchbotError as error:
        said = {"problem": f"{error.title} {error.why}"}
    results.write_json(folder.conclusion, {"of": evaluated, **said})
    events.tell("evaluated", **said)


def _evaluated(folder: Folder, plan: Plan, *, archive: bool) -> str:
    """Return a hash of all that an evaluation depends on: it is made again when episodes were computed once more."""
    found = {}
    for episode in plan.episodes:
        with suppress(FileNotFoundError):
            found[episode.name] = sha256(folder.result(episode.name).read_bytes()).hexdigest()
    return digest([plan.hash, plan.method, archive, found])


def _is_concluded(folder: Folder, evaluated: str) -> bool:
    try:
        return bool(json.loads(folder.conclusion.read_bytes())["of"] == evaluated)
    except (OSError, ValueError, TypeError, KeyError):
        return False
