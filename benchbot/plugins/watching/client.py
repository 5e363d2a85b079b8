"""A client of the routes of those who look on, with the operator's token."""

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import urlencode

from benchbot.api.client import Client
from benchbot.wire.run_state import Connection, RunState


class WatchClient(Client):
    """The host's own connection to a run; not thread-safe. Methods raise BenchbotError as `Client`'s do."""

    def __init__(self, state: RunState, answer_timeout_s: float | None = None) -> None:
        connection = Connection(state.connection.url, state.connection.socket, state.operator_token)
        super().__init__(connection, answer_timeout_s, shares_memory=False)

    def watch(
        self,
        *,
        after: int = 0,
        channels: Sequence[str] = (),
        width: int = 0,
        with_session: bool = False,
        with_path: bool = True,
    ) -> dict[str, Any]:
        """Return where the run stands, with what has been seen after observation `after` in these channels, if any."""
        asked: dict[str, Any] = {"session": int(with_session), "path": int(with_path)}
        if channels:
            asked |= {"after": after, "channels": ",".join(channels), "width": width}
        return self._call("GET", f"watch?{urlencode(asked)}")

    def pause(self, *, paused: bool) -> None:
        """Hold the solution's next step, or let it go on."""
        self._call("POST", "watch/gate", {"paused": paused})

    def let_through(self, steps: int) -> None:
        """Let so many steps of the solution through, and hold the next."""
        self._call("POST", "watch/gate", {"steps": steps})

    def drive(self, action: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Take an action by hand, to its end; return `{action, arguments, by_hand, outcome, result}`."""
        return self._call("POST", "watch/drive", {"action": action, "arguments": dict(arguments)})
