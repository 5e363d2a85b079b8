"""Runs that follow one another on one platform: each its own session and folder, what is loaded stays loaded."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from benchbot.core.errors import BenchbotError
from benchbot.core.host import Host
from benchbot.core.selection import Selection
from benchbot.supervisor.platform.host import ChildHost, Timeouts
from benchbot.supervisor.run import Run
from benchbot.wire.run_state import RunFolder


@dataclass(frozen=True)
class RunOrder:
    """What to run: a selection, and the folders that recorders, by their names, write into."""

    selection: Selection
    record: Mapping[str, Path] = field(default_factory=dict)


class Succession:
    """One run at a time. The platform's process, its log and the supervisor's are shared by all of them.

    The folder of the first run holds the logs, and stays until the end. Of each run's folder the result is kept.
    """

    def __init__(self, options: Mapping[str, Any] | None, timeouts: Timeouts | None) -> None:
        self._options = options
        self._timeouts = timeouts
        self._base = RunFolder()
        self._folder = self._base
        self._run: Run | None = None
        self._warm: Host | None = None
        self._platform_failed = False

    @property
    def platform_log(self) -> Path:
        """What the platform's process prints."""
        return self._base.path / "platform.log"

    @property
    def supervisor_log(self) -> Path:
        """What the supervisor logs."""
        return self._base.path / "supervisor.log"

    @property
    def folder(self) -> RunFolder:
        """The folder of the run that there is."""
        return self._folder

    def begin(self, order: RunOrder) -> Run:
        """End the run that there is, but not its platform, and return the next one."""
        if self._run is not None:
            self._warm = self._run.release()
            self._note_failure()
            self._leave_folder()
            self._folder = RunFolder()
        self._run = run = Run(order.selection, lambda: self._start_host(run), self._folder.result)
        run.recordings.begin(order.record)
        return run

    def close_run(self) -> None:
        """End the run that there is, and its platform."""
        if self._run is not None:
            self._run.close()
            self._note_failure()
        self._close_warm()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._folder is not self._base:
            self._leave_folder()
        self._base.close(keep=self._platform_failed or self._base.result.exists())

    def _start_host(self, run: Run) -> ChildHost:
        warm, self._warm = self._warm, None
        if isinstance(warm, ChildHost):
            with suppress(BenchbotError):  # it has died meanwhile: a new one takes its place
                warm.renew(run.selection, run.operator)
                return warm
            warm.close()
        return ChildHost(
            run.selection,
            self.platform_log,
            options=self._options,
            timeouts=self._timeouts,
            operator=run.operator,
            lends=True,
        )

    def _note_failure(self) -> None:
        self._platform_failed |= self._run is not None and self._run.platform_failed

    def _leave_folder(self) -> None:
        if self._folder is self._base:
            self._base.unpublish()
        else:
            self._folder.close(keep=self._folder.result.exists())

    def _close_warm(self) -> None:
        warm, self._warm = self._warm, None
        if warm is not None:
            warm.close()
