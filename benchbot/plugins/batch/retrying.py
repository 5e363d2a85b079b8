"""Beginning anew with episodes that have failed for good."""

import secrets

from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean
from benchbot.plugins.batch import plan as plans
from benchbot.plugins.batch.attempts import RETRIED, Attempts
from benchbot.plugins.batch.claims import HeldClaim
from benchbot.plugins.batch.events import EventLog, check_writable
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.request import names


def begin_anew(folder: Folder, failed: str | None) -> int:
    """Make finished episodes of these classes of failure pending again; return how many.

    `failed` names classes (`agent,timeout`), None is those that are nobody's fault. Raises BenchbotError for others.
    """
    classes = set(RETRIED) if failed is None else {_class(name) for name in names(failed)}
    plan = plans.read(folder.plan)
    check_writable(folder.claims)
    events, me = EventLog(folder.events, "driver"), f"retry-{secrets.token_hex(4)}"
    count = 0
    for episode in plan.episodes:
        attempts = Attempts(folder.episode(episode.name))
        finished = attempts.finished()
        if finished is None or finished.failure not in classes:
            continue
        claim = HeldClaim.take(folder.claims / episode.key, me)
        if claim is not None:
            try:
                attempts.begin_anew()
            finally:
                claim.release()
            events.tell("retried", key=episode.key)
            count += 1
    return count


def _class(name: str) -> FailureClass:
    known = [str(each) for each in FailureClass]
    if name not in known:
        raise BenchbotError(
            f"'{name}' is not a class of failure.",
            f"They are: {', '.join(known)}.{did_you_mean(name, known)}",
            "Name some of them: --failed platform,infrastructure",
        )
    return FailureClass(name)
