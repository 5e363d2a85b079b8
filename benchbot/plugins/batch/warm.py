"""The back end of a worker, kept warm: while episodes are in one place, its simulator stays as it is."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch.plan import Place, Plan, PlannedEpisode
from benchbot.submission.modes import private_socket
from benchbot.supervisor.backend import Backend
from benchbot.wire.run_state import RunState

START_TIMEOUT_S = 300.0


class WarmBackend:
    """At most one back end, of the place of the episode that was begun last."""

    def __init__(self, plan: Plan, *, needs_socket: bool) -> None:
        self._plan = plan
        self._needs_socket = needs_socket
        self._place: Place | None = None
        self._backend: Backend | None = None
        self._stack = ExitStack()

    @property
    def place(self) -> Place | None:
        """What the back end has loaded, or None when there is none."""
        return self._place

    def begin(self, episode: PlannedEpisode, record: Mapping[str, Path]) -> RunState:
        """Begin an episode, on the back end that there is if it is of the same place; return how to reach it.

        Raises BenchbotError when a fresh one does not start either.
        """
        request = replace(self._plan.request_of(episode), record={name: str(folder) for name, folder in record.items()})
        backend = self._backend
        if backend is not None and self._place == episode.place and backend.died() is None:
            try:
                backend.begin(request)
            except BenchbotError:
                # Stuck or dying: a fresh one tells whether the episode is the reason.
                self.close()
            else:
                return backend.state
        self.close()
        self._backend = self._stack.enter_context(
            Backend.start(
                request,
                port=None if self._needs_socket else 0,
                unix_socket=self._stack.enter_context(private_socket()) if self._needs_socket else None,
                start_timeout_s=START_TIMEOUT_S,
            )
        )
        self._place = episode.place
        return self._backend.state

    @property
    def died(self) -> Callable[[], BenchbotError | None]:
        """What tells why the back end is gone, if it is."""
        backend = self._backend
        return lambda: None if backend is None else backend.died()

    def close(self) -> None:
        """End the back end, if there is one."""
        self._backend = self._place = None
        self._stack.close()
