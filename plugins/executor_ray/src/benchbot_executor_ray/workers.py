"""The executor `ray`, as a driver sees it."""

import functools
import json
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

from benchbot.core.errors import BenchbotError, ExitCode
from benchbot.core.hookspecs import WorkOrder
from benchbot.supervisor.children import last_words


@dataclass(frozen=True)
class RayWorkers:
    """The workers of one launch, by their reference: the cluster, a namespace in it, and what each worker needs."""

    reference: str

    def alive(self) -> int:
        """Return how many run or wait for room; raises BenchbotError when they never can."""
        count: int = _helper().ask(do="alive", reference=self.reference)
        return count

    def stop(self) -> None:
        """End them: in order those that run, at once those that wait."""
        _helper().ask(do="stop", reference=self.reference)


def launch(order: WorkOrder) -> RayWorkers:
    """Create the actors; raises BenchbotError when there is no cluster, or none of its nodes could ever run them."""
    plain = {
        "folder": str(order.folder.absolute()),
        "command": order.command,
        "count": order.count,
        "resources": asdict(order.resources),
        "options": dict(order.options),
    }
    return RayWorkers(_helper().ask(do="launch", order=plain))


class LostError(Exception):
    """The helper has ended before it answered."""


class Helper:
    """The process that talks with Ray; it is started when there is something to ask, and anew when it is lost."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._asked = 0
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
        raise BenchbotError(
            "The connection to the Ray cluster was lost.",
            f"The process that talks with it has ended, as it does when the head is gone. {last_words(self._log)}",
            "See to the head (ray status), then run the same command again: what is finished stays finished.",
            exit_code=ExitCode.INTERNAL,
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


@functools.cache
def _helper() -> Helper:
    return Helper()
