"""A solution in its container: made, started, watched, and always removed."""

import secrets
import signal
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.plugins.containers import outbox
from benchbot.plugins.containers.engine import Engine, failed
from benchbot.plugins.containers.image import LABEL
from benchbot.process import LastWords
from benchbot.submission import limits
from benchbot.submission.init.process import GRACE_S
from benchbot.submission.modes import ProcessLimits

if TYPE_CHECKING:
    from docker import APIClient

SIGNALS_FROM = 128
"""What an exit status is greater than by the signal that ended the process, as shells and engines say it."""

UNKNOWN = 125
"""The exit status of a container that the engine lost; `docker run` says it like that."""

GOING_ON = {"running", "paused", "restarting", "stopping"}
"""What an engine says of a container that has not ended."""

POLLS_S = 0.01, 0.1
"""How soon the engine is asked how a container has ended, at first and later."""

Made = TypeVar("Made")


class Container:
    """The running container of a solution.

    Its output goes to `output`, chunk by chunk. Leaving the context removes the container, and every process in it
    with it: asked by SIGTERM, then killed.
    """

    def __init__(
        self,
        engine: Engine,
        image: str,
        user: tuple[int, int],
        variables: Mapping[str, str],
        host_config: dict[str, Any],
        within: ProcessLimits,
        output: Callable[[bytes], object],
        take_result: Callable[[], str | None],
    ) -> None:
        self._engine = engine
        self._image = image
        self._user = user
        self._variables = dict(variables)
        self._host_config = host_config
        self._limits = within
        self._output = output
        self._take_result = take_result
        self._name = f"benchbot-{secrets.token_hex(8)}"
        self._client = engine.connect()
        self._follower: threading.Thread | None = None
        self._ended = threading.Event()
        self._status = UNKNOWN
        self._failure: BenchbotError | None = None
        self._removed = False
        self._last_words = LastWords()
        self._process = 0

    def __enter__(self) -> Self:
        from docker.errors import APIError, DockerException
        from requests.exceptions import RequestException

        try:
            undisturbed(self._make)
            follower = self._engine.connect()
            stream = follower.attach(self._name, stdout=True, stderr=True, stream=True)
            self._follower = threading.Thread(target=self._follow, args=(follower, stream), daemon=True)
            self._follower.start()
            undisturbed(lambda: self._client.start(self._name))
            self._process = int(self._client.inspect_container(self._name)["State"]["Pid"])
        except APIError as error:
            self.end()
            raise self._cannot_start(error) from error
        except (DockerException, RequestException) as error:
            self.end()
            raise failed("start the container", error) from error
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()

    @property
    def process(self) -> int:
        """This machine's number of the container's first process."""
        return self._process

    @property
    def last_words(self) -> str:
        """The last lines of its output."""
        return str(self._last_words)

    def wait(self, timeout_s: float) -> int | None:
        """Return the exit status (negative: the signal that ended it), or None when it still runs after `timeout_s`."""
        return self._status if self._ended.wait(timeout_s) else None

    def explain(self, status: int) -> BenchbotError | None:
        """Return which limit has ended it with `status`, as far as it tells; or how it, or its result, was lost.

        Takes the result of one that has ended well.
        """
        if self._failure is not None:
            return self._failure
        if status == 0:
            why = self._take_result()
            return None if why is None else outbox.refused(why)
        if status == -signal.SIGKILL:
            # Nobody else kills it; podman does not always tell that the kernel did, for its memory.
            return limits.out_of_memory(self._limits, self.last_words)
        return limits.explain(self._limits, status, self.last_words)

    def end(self) -> None:
        """End and remove it. May be called more than once."""
        if self._removed:
            return
        undisturbed(self._remove)
        self._removed = True
        if self._follower is not None:
            self._follower.join(GRACE_S)
        self._client.close()

    def _make(self) -> None:
        self._client.create_container_from_config(  # type: ignore[no-untyped-call]
            {
                "Image": self._image,
                "User": "{}:{}".format(*self._user),
                "Hostname": "solution",
                "Env": [f"{name}={value}" for name, value in self._variables.items()],
                "Labels": {LABEL: "1"},
                "AttachStdout": True,
                "AttachStderr": True,
                "HostConfig": self._host_config,
            },
            name=self._name,
        )

    def _remove(self) -> None:
        from docker.errors import APIError

        with closing(self._engine.connect()) as client, suppress(APIError):
            if not self._ended.is_set():
                client.stop(self._name, timeout=int(GRACE_S))
                if self._follower is not None:  # who asks how it has ended, and must not find it gone
                    self._ended.wait(GRACE_S)
        with closing(self._engine.connect()) as client, suppress(APIError):
            client.remove_container(self._name, force=True, v=True)

    def _follow(self, client: "APIClient", stream: Any) -> None:
        """Pass on what it prints until it ends, and learn how it ended."""
        from docker.errors import DockerException
        from requests.exceptions import RequestException

        with closing(client):
            try:
                for chunk in stream:
                    self._last_words.add(chunk)
                    self._output(chunk)
                status = self._exit_status(client)
                self._status = SIGNALS_FROM - status if SIGNALS_FROM < status <= SIGNALS_FROM + 64 else status
            except (DockerException, RequestException, OSError) as error:
                self._failure = failed("follow the container", error)
            finally:
                self._ended.set()

    def _exit_status(self, client: "APIClient") -> int:
        """Return how it has ended, when it has: its output may end before.

        The engine is not asked to wait: podman does by looking without a pause, at the cost of a whole processor, and
        keeps its locks from the process of its own that would say that the container has ended.
        """
        pause_s, longest_s = POLLS_S
        while (state := client.inspect_container(self._name)["State"])["Status"] in GOING_ON:
            time.sleep(pause_s)
            pause_s = min(1.5 * pause_s, longest_s)
        return int(state["ExitCode"])

    def _cannot_start(self, error: Any) -> BenchbotError:
        return BenchbotError(
            "The container cannot be started.",
            f"{self._engine.name} says: {error.explanation or error}",
            "Check the Dockerfile's CMD or ENTRYPOINT, and try 'podman run' or 'docker run' with the image: "
            f"{self._image}",
            exit_code=ExitCode.USAGE,
            failure=FailureClass.AGENT,
        )


def undisturbed(call: Callable[[], Made]) -> Made:
    """Return what `call` does, having waited for it even when an interrupt arrives: that is raised afterwards.

    Half a request would leave a container that nobody knows of.
    """
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call).result()
