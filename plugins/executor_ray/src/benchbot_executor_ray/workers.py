"""The executor `ray`, as a driver sees it."""

import functools
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

from benchbot.cli.kit.preflight import Intent
from benchbot.plugin import BenchbotError, Catalog, ExitCode, Finding, Level, WorkOrder
from benchbot.process import last_words
from benchbot_executor_ray import options


@dataclass(frozen=True)
class RayWorkers:
    """The workers of one launch, by their reference: the cluster, a namespace in it, and what each worker needs."""

    reference: str

    def alive(self) -> int:
        """Return how many run or wait for room; raises BenchbotError when they never can, or the cluster gets lost."""
        count: int | None = _helper().ask(do="alive", reference=self.reference)
        if count is None and self.reference in _helper().seen:
            raise _lost("Its head does not answer any more.")
        if count:
            _helper().seen.add(self.reference)
        # A cluster that is gone has taken its actors along, those of an earlier driver.
        return count or 0

    def stop(self) -> None:
        """End them: in order those that run, at once those that wait."""
        _helper().ask(do="stop", reference=self.reference)


def launch(order: WorkOrder) -> RayWorkers:
    """Create the actors; raises BenchbotError when there is no cluster, or none of its nodes could ever run them."""
    return RayWorkers(_helper().ask(do="launch", order=_plain(order), environment=options.environment(order)))


def check(_catalog: Catalog, intent: Intent) -> Iterator[Finding]:
    """Yield where the cluster is that is to run workers; raises BenchbotError as `launch` does."""
    if intent.executor == "ray" and intent.order is not None:
        yield Finding(Level.OK, "Ray", f"the cluster at {_helper().ask(do='check', order=_plain(intent.order))}")


def _plain(order: WorkOrder) -> dict[str, Any]:
    return {
        "folder": str(order.folder.absolute()),
        "command": order.command,
        "count": order.count,
        "resources": asdict(order.resources),
        "options": dict(order.options),
    }


class LostError(Exception):
    """The helper has ended before it answered."""


class Helper:
    """The process that is connected to Ray; it is started at the first request, and again after it was lost."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._asked = 0
        self.seen: set[str] = set()
        """References of workers that were alive when they were asked about."""
        # What Ray says about itself is of use only when it fails.
        self._log = tempfile.TemporaryFile()  # noqa: SIM115

    def ask(self, **request: Any) -> Any:
        """Return the helper's answer; raises the BenchbotError that it answers with, or one when it is lost."""
        try:
            return self._ask(request)
        except LostError:
            # Whether anything was launched is not known; all else may be asked twice.
            if request["do"] != "launch":
                with suppress(LostError):
                    return self._ask(request)
        raise _lost(
            f"The process that talks with it has ended, as it does when the head is gone. {last_words(self._log)}"
        )

    def _ask(self, request: dict[str, Any]) -> Any:
        if self._process is None or self._process.poll() is not None:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "benchbot_executor_ray.helper"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                text=True,
                encoding="utf-8",
                # Ctrl-C is for the driver, which still needs it to end the workers.
                start_new_session=True,
            )
        self._asked += 1
        requests, answers = self._process.stdin, self._process.stdout
        if requests is None or answers is None:
            raise AssertionError("the helper was started with pipes")
        with suppress(BrokenPipeError):
            requests.write(json.dumps({"number": self._asked, **request}) + "\n")
            requests.flush()
            for line in answers:
                said = json.loads(line)
                # An answer to an earlier request was not waited for: the driver was interrupted.
                if said["number"] == self._asked:
                    if "error" in said:
                        raise BenchbotError(*(said["error"][key] for key in ("title", "why", "fix")))
                    return said["answer"]
        self._process.wait()
        raise LostError


def _lost(why: str) -> BenchbotError:
    return BenchbotError(
        "The Ray cluster was lost.",
        f"{why} Without a head Ray ends all workers, about a minute later. The results that were written stay.",
        "Start the cluster again (ray stop; ray start --head), then run the same command again: it goes on.",
        exit_code=ExitCode.INTERNAL,
    )


@functools.cache
def _helper() -> Helper:
    return Helper()
