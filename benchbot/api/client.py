"""The client of the v1 API: one method per route, errors raised as the supervisor reports them."""

import json
import os
import weakref
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self
from urllib.parse import quote

from benchbot.api.transport import Transport
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.wire import arena, encoding
from benchbot.wire.joining import find
from benchbot.wire.run_state import Connection

if TYPE_CHECKING:
    from numpy.typing import NDArray

MSGPACK = "application/msgpack"


class Client:
    """A keep-alive connection to a supervisor; every method raises BenchbotError as the supervisor reports it.

    A lost connection is a BenchbotError with failure `infrastructure`, and so is an answer that does not come within
    `answer_timeout_s`, if given: an action may take as long as it takes. Not thread-safe: one client per thread.
    Arrays come through shared memory where the supervisor's can be opened from here, and `shares_memory` is true; else
    as bytes. They are the caller's to keep and to write on either way.
    """

    def __init__(
        self,
        connection: Connection | None = None,
        answer_timeout_s: float | None = None,
        *,
        shares_memory: bool = True,
    ) -> None:
        self.connection = connection or find()
        self._shares_memory = shares_memory
        self._memory: SharedMemory | None = None
        self._transport = Transport(self.connection.url, self.connection.socket, answer_timeout_s)

    def health(self) -> dict[str, Any]:
        """Return the server's name, version and process number. Needs no token."""
        return self._call("GET", "health")

    def session(self) -> dict[str, Any]:
        """Return the session: task, environments, robot, state, progress (see docs/wire.md)."""
        return self._call("GET", "session")

    def reset(self) -> dict[str, Any]:
        """Start anew in the first scene; return the first observations and the state."""
        return self._observe("reset")

    def step(self, action: str | None, arguments: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Take one action (None only observes); return observations, result, available actions and state."""
        return self._observe("step", {"action": action, "arguments": dict(arguments or {})})

    def next_scene(self) -> dict[str, Any]:
        """Advance to the next scene; `advanced` is false (and there are no observations) when there is none."""
        return self._observe("next_scene")

    def result(self, document: Mapping[str, Any] | None, solution: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Have a result checked and completed with provenance; return `{document, path, timings}`. None: there is none.

        Sending it again, for example with details of the solution, replaces the one before. A supervisor keeps back
        what a solution is not to know, such as the seed: the document is whole where the file at `path` can be read.
        """
        return _with_kept(self._call("POST", "result", {"result": document, "solution": solution}))

    def failed(self, failure: FailureClass, why: str, solution: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Record that the episode failed and return its result document as `{document, path, timings}`: see `result`.

        The first failure of an episode stays: a dead platform is not renamed to a crashed agent.
        """
        body = {"failure": {"class": failure, "why": why}, "solution": solution}
        return _with_kept(self._call("POST", "result", body))

    def results_function(self, name: str, args: Sequence[Any] = (), kwargs: Mapping[str, Any] | None = None) -> Any:
        """Call a function of the task's results format (`create`, `create_object`, `validate`, …)."""
        body = {"args": list(args), "kwargs": dict(kwargs or {})}
        return self._call("POST", f"results_functions/{quote(name, safe='')}", body)["value"]

    def stop(self, by: str = "") -> None:
        """End the run; `by` says who does, where it is the run's user."""
        self._call("POST", "stop", {"by": by})

    def confirm(self) -> str:
        """Confirm that the operator has done the requested work, and return the request.

        Needs a connection with the operator's token.
        """
        return str(self._call("POST", "operator", {"done": True})["confirmed"])

    def record(self, begin: Mapping[str, Path] | None = None, finish: Sequence[Path] = ()) -> list[dict[str, Any]]:
        """Finish the recordings in some folders, begin others, by recorder; return those that continue.

        Needs a connection with the operator's token.
        """
        folders = {name: str(folder.absolute()) for name, folder in (begin or {}).items()}
        body = {"begin": folders, "finish": [str(folder.absolute()) for folder in finish]}
        recordings: list[dict[str, Any]] = self._call("POST", "watch/record", body)["recordings"]
        return recordings

    def close(self) -> None:
        """Close the connection."""
        self._transport.close()
        self._close_memory()

    def _observe(self, route: str, body: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Send a request that is answered with observations, which may lie in shared memory (docs/wire.md)."""
        if not self._shares_memory:
            return self._call("POST", route, body)
        memory = self._memory
        opened = "none" if memory is None else memory.nonce
        answer = self._call("POST", route, body, {encoding.ARENA_HEADER: opened}, memory.read if memory else None)
        told = answer.pop("arena", None)
        if not isinstance(told, dict):
            return answer
        if "descriptor" in told:
            self._close_memory()
            self._memory = SharedMemory.open(told)
            self._shares_memory = self._memory is not None
            return answer
        if memory is None or told.get("nonce") != memory.nonce:
            raise BenchbotError(
                "The answer lies in memory that this client has not opened.",
                f"It names the arena {told.get('nonce')!r}, and the client has opened {opened!r}.",
                "Run again; if it happens again, report it.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            )
        if "observations" in answer and not memory.holds(told.get("sequence")):
            # Another client has observed meanwhile, so the arrays are overwritten. The second answer comes as bytes.
            again = self._call("POST", "step", {"action": None})
            return {**answer, **again, "outcome": answer["outcome"]}
        return answer

    def _close_memory(self) -> None:
        if self._memory is not None:
            self._memory.close()
            self._memory = None

    def _call(
        self,
        method: str,
        route: str,
        body: Mapping[str, Any] | None = None,
        more_headers: Mapping[str, str] | None = None,
        fetch: encoding.Fetch | None = None,
    ) -> dict[str, Any]:
        headers = {"Accept": MSGPACK, "Authorization": f"Bearer {self.connection.token}", **(more_headers or {})}
        data = b""
        if body is not None:
            headers["Content-Type"] = MSGPACK
            data = encoding.encode(body)
            if len(data) > encoding.MAX_BODY_BYTES:
                raise BenchbotError(
                    "The request is too large.",
                    f"It has {len(data)} bytes, and the supervisor reads at most {encoding.MAX_BODY_BYTES}.",
                    "Send less: a result of this size is most likely not what the task asks for.",
                    exit_code=ExitCode.SUBMISSION_FAILED,
                    failure=FailureClass.AGENT,
                )
        status, content_type, content = self._transport.request(method, f"/api/v1/{route}", data, headers)
        if status >= 300 or content_type != MSGPACK:
            raise _error(status, bytes(content))
        answer = encoding.decode(content, fetch)
        if not isinstance(answer, dict):
            raise _error(status, bytes(content))
        return answer


class SharedMemory:
    """An arena (docs/wire.md) that a supervisor has offered, open for reading; `nonce` names it."""

    def __init__(self, handle: int) -> None:
        self._reader = arena.ArenaReader(handle)
        self.nonce = self._reader.nonce
        # A client that is dropped without close() must not leak the descriptor.
        self._close = weakref.finalize(self, os.close, handle)

    @classmethod
    def open(cls, offered: Any) -> Self | None:
        """Return the offered arena, or None when it cannot be reached: another user, container or system.

        Nothing is opened but an anonymous file of that name, so an offer cannot lead anywhere else.
        """
        try:
            path = f"/proc/{int(offered['pid'])}/fd/{int(offered['descriptor'])}"
            if str(Path(path).readlink()) != f"/memfd:{arena.NAME} (deleted)":
                return None
            handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        except (OSError, KeyError, TypeError, ValueError):
            return None
        try:
            memory = cls(handle)
        except ValueError:
            os.close(handle)
            return None
        # Elsewhere, this process number may belong to another supervisor.
        if memory.nonce != offered.get("nonce"):
            memory.close()
            return None
        return memory

    def read(self, dtype: str, shape: list[int], offset: int) -> "NDArray[Any]":
        """Return a copy of an array; raises ValueError when it lies outside of the memory."""
        return self._reader.read(dtype, shape, offset)

    def holds(self, sequence: Any) -> bool:
        """Say whether the arena still holds what a supervisor wrote as number `sequence`."""
        return bool(self._reader.sequence == sequence)

    def close(self) -> None:
        """Unmap the memory and close its file."""
        self._reader.close()
        self._close()


def _with_kept(answer: dict[str, Any]) -> dict[str, Any]:
    try:
        document = json.loads(Path(answer["path"]).read_text("utf-8"))
    except (OSError, ValueError):  # a sandbox does not show it, and nor does another machine
        return answer
    return {**answer, "document": document}


def _error(status: int, content: bytes) -> BenchbotError:
    """Return the error that an answer tells, or one that says that this was no BenchBot supervisor."""
    try:
        said = json.loads(content)
        title, why, fix = said["title"], said["why"], said["fix"]
        failure = FailureClass(said["failure"]) if "failure" in said else None
        ends_run = said.get("ends_run") is True
    except (ValueError, KeyError, TypeError):
        return BenchbotError(
            "What answers is not a BenchBot supervisor.",
            f"It answered with status {status}: {content[:200].decode('utf-8', 'replace')!r}",
            "Check BENCHBOT_URL, or the argument supervisor_address.",
        )
    ours = failure in (FailureClass.PLATFORM, FailureClass.INFRASTRUCTURE) or status >= 500
    code = ExitCode.INTERNAL if ours else ExitCode.USAGE if failure is None else ExitCode.SUBMISSION_FAILED
    return BenchbotError(title, why, fix, exit_code=code, failure=failure, ends_run=ends_run)
