"""The early end of a batch that cannot become what was wanted: its canary failed, or too many episodes did.

The canary of a solution is its first episode: no other is begun before it is finished, on whatever machine. When it
failed as every other would, workers and driver end. It is computed anew when the batch goes on.
"""

import json
import math
import secrets
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.plugins.batch.attempts import RETRIED
from benchbot.plugins.batch.claims import HeldClaim
from benchbot.plugins.batch.error_groups import lines, remedy
from benchbot.plugins.batch.folder import Folder
from benchbot.plugins.batch.plan import Plan, PlannedEpisode
from benchbot.plugins.batch.status import BatchStatus
from benchbot.process import last_words
from benchbot.submission.episode import CRASHED, EXIT_CODES


class Canaries:
    """The canaries of a batch that are not known to be well yet."""

    def __init__(self, folder: Folder, plan: Plan) -> None:
        self._folder = folder
        self._left = {episode.key: episode for episode in _first(plan)} if plan.policy.canary else {}

    def check(self) -> None:
        """Raise BenchbotError when one has failed as every other episode would."""
        for key, episode in list(self._left.items()):
            if self._folder.attempts(episode).finished() is not None:
                failed = _failed(self._folder, episode)
                if failed is not None:
                    raise failed
                del self._left[key]

    def holds_back(self, episode: PlannedEpisode) -> bool:
        """Say whether an episode has to wait for a canary."""
        return bool(self._left) and episode.key not in self._left

    def begin_anew(self) -> None:
        """Make those pending again that have failed; raises OSError."""
        for episode in self._left.values():
            attempts = self._folder.attempts(episode)
            if attempts.finished() is None or _failed(self._folder, episode) is None:
                continue
            claim = HeldClaim.take(self._folder.claims / episode.key, f"canary-{secrets.token_hex(4)}")
            if claim is not None:
                try:
                    attempts.begin_anew()
                finally:
                    claim.release()


def check_failures(status: BatchStatus, plan: Plan) -> None:
    """Raise BenchbotError when as many episodes have failed as are to end the batch; collisions are results."""
    limit = plan.policy.fail_on_error
    if limit is None:
        return
    fewest = limit if isinstance(limit, int) else max(1, math.ceil(limit * status.episodes))
    classes = {FailureClass(name): count for name, count in status.failures.items() if name != FailureClass.COLLISION}
    count = sum(classes.values())
    if count >= fewest and not status.is_complete:
        code = ExitCode.INTERNAL if any(failure in RETRIED for failure in classes) else ExitCode.SUBMISSION_FAILED
        raise BenchbotError(
            f"{count} of {status.episodes} episodes failed: the batch was ended.",
            "\n".join([f"It was to end at {fewest} (--fail-on-error {limit}).", *lines(status.errors, status.folder)]),
            "Mend the cause, then compute them once more: "
            f"benchbot batch retry {status.folder} --failed {','.join(classes)}",
            exit_code=code,
        )


def failure_limit(text: object) -> int | float:
    """Return a number of episodes (an integer) or a fraction of all; raises BenchbotError for anything else."""
    said = str(text)
    with suppress(ValueError):
        limit = float(said[:-1]) / 100 if said.endswith("%") else float(said)
        if said.isdigit() and limit >= 1:
            return int(said)
        if not said.isdigit() and 0 < limit <= 1:
            return limit
    raise BenchbotError(
        f"--fail-on-error {text} says not when.",
        "It is a number of episodes, 1 or more, or a fraction of all of them, such as 0.1 or 10%.",
        "Write it like this: --fail-on-error 5   or: --fail-on-error 0.1",
    )


def _first(plan: Plan) -> list[PlannedEpisode]:
    """Return the first episode of each solution that has others as well."""
    found: dict[str | None, list[PlannedEpisode]] = {}
    for episode in plan.episodes:
        found.setdefault(episode.solution, []).append(episode)
    return [episodes[0] for episodes in found.values() if len(episodes) > 1]


def _failed(folder: Folder, episode: PlannedEpisode) -> BenchbotError | None:
    """Return why a finished canary tells that every other episode would fail; None when it does not."""
    try:
        provenance = json.loads(folder.result(episode.name).read_bytes())["provenance"]
        failure: Mapping[str, Any] | None = provenance["failure"]
        if failure is None or not _fails_all(FailureClass(failure["class"]), failure["why"], provenance["steps"]):
            return None
    except (OSError, ValueError, TypeError, KeyError):
        return None
    log, said = folder.episode(episode.name) / "log.txt", ""
    with suppress(OSError), log.open("rb") as file:
        said = last_words(file)
    return BenchbotError(
        "The first episode failed as all others would: the batch was ended.",
        f"{episode.name} ({failure['class']}): {failure['why'].splitlines()[0]}\n{said}",
        f"{remedy(failure['why']) or 'Mend the cause.'}\n"
        "Then run the same command again: it begins with this episode.\n"
        f"The whole log: {log}   To compute all of them nevertheless: --no-canary",
        exit_code=EXIT_CODES.get(FailureClass(failure["class"]), ExitCode.SUBMISSION_FAILED),
    )


def _fails_all(failure: FailureClass, why: str, steps: int) -> bool:
    """Say whether a failure has nothing to do with the place: nothing began, or what was handed in is no result."""
    return steps == 0 or (failure is FailureClass.AGENT and not why.startswith(CRASHED))
