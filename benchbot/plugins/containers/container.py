"""The container of a solution: created, started, watched, and always removed."""

import secrets
import signal
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from typing import Any, Self, TypeVar

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.plugins.containers.engine import Engine, api_errors, failed
from benchbot.plugins.containers.image import LABEL, LIBPOD
from benchbot.plugins.sandbox.control_group import ControlGroup, of_process
from benchbot.plugins.sandbox.weak_limits import CPU_TIME, refused
from benchbot.process import LastWords
from benchbot.submission import limits
from benchbot.submission.init.process import GRACE_S
from benchbot.submission.modes import ProcessLimits
from benchbot.submission.output import refused_result

SIGNALS_FROM = 128
"""The exit status of a process that a signal ended is that signal plus this, for shells and engines."""

UNKNOWN = 125
"""The exit status of a container that the engine lost, as of `docker run`."""

RUNNING = {"running", "paused", "restarting", "stopping"}
"""The states of a container that has not ended."""

POLLS_S = 0.01, 0.1
"""The first and the longest pause between questions to the engine for the end of a container."""

TELLS_END_WITHIN_S = 5.0
"""How long an engine may take to tell the end of a process that is gone."""

Result = TypeVar("Result")


class Container:
    """The running container of a solution, with a `config` of the Docker Engine API.

    Its output goes to `output`, chunk by chunk. Leaving the context removes the container, and every process in it
    with it: asked by SIGTERM, then killed.
    """

    def __init__(
        self,
        engine: Engine,
        config: Mapping[str, Any],
        within: ProcessLimits,
        output: Callable[[bytes], object],
        take_result: Callable[[], str | None],
    ) -> None:
        self._engine = engine
        self._config = {**config, "Labels": {LABEL: "1"}, "AttachStdout": True, "AttachStderr": True}
        self._limits = within
        self._output = output
        self._take_result = take_result
        self._name = f"benchbot-{secrets.token_hex(8)}"
        self._client = engine.connect()
        self._group: ControlGroup | None = None
        self._follower: threading.Thread | None = None
        self._ended = threading.Event()
        self._status = UNKNOWN
        self._failure: BenchbotError | None = None
        self._removed = False
        self._last_words = LastWords()
        self.process = 0  # the number of the container's first process on this machine

    def __enter__(self) -> Self:
        from docker.errors import APIError

        try:
            create: Callable[..., object] = self._client.create_container_from_config
            undisturbed(lambda: create(self._config, name=self._name))
            follower = self._engine.connect()
            stream = follower.attach(self._name, stdout=True, stderr=True, stream=True)
            self._follower = threading.Thread(target=self._follow, args=(follower, stream), daemon=True)
            self._follower.start()
            self._limit_each_process()
            undisturbed(lambda: self._client.start(self._name))
            self.process = int(self._client.inspect_container(self._name)["State"]["Pid"])
            self._group = of_process(self.process)
        except APIError as error:
            self.end()
            raise self._cannot_start(error) from error
        except api_errors() as error:
            self.end()
            raise failed("start the container", error) from error
        except BaseException:
            self.end()
            raise
        unseen = self._group is None and self._limits.cpu_time_s is not None
        # A solution that is over at once leaves no group either; the engine tells its end a little later.
        if unseen and not self._ended.wait(TELLS_END_WITHIN_S):
            self.end()
            raise refused([CPU_TIME], "The CPU time of its container cannot be seen on this machine.")
        return self

    def __exit__(self, *_error: object) -> None:
        self.end()

    @property
    def last_words(self) -> str:
        """The last lines of its output."""
        return str(self._last_words)

    def wait(self, timeout_s: float) -> int | None:
        """Return the exit status (negative: the signal that ended it), or None when it still runs after `timeout_s`."""
        if self._ended.wait(timeout_s):
            return self._status
        most_s = self._limits.cpu_time_s
        if most_s is not None and self._group is not None and self._group.cpu_time_s() > most_s:
            self.end()
            return -signal.SIGXCPU
        return None

    def explain(self, status: int) -> BenchbotError | None:
        """Return the limit that ended it with `status`, if it can be told; or why it, or its result, was lost.

        The result of one that has ended well is taken here.
        """
        if self._failure is not None:
            return self._failure
        if status == 0:
            why = self._take_result()
            return None if why is None else refused_result(why)
        if status == -signal.SIGKILL:
            # Only the kernel kills it, for its memory; podman does not always report that.
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

    def _remove(self) -> None:
        from docker.errors import APIError

        with closing(self._engine.connect()) as client, suppress(APIError):
            if not self._ended.is_set():
                client.stop(self._name, timeout=int(GRACE_S))
                if self._follower is not None:  # it still asks for the exit status
                    self._ended.wait(GRACE_S)
        with closing(self._engine.connect()) as client, suppress(APIError):
            client.remove_container(self._name, force=True, v=True)

    def _limit_each_process(self) -> None:
        """Set its limits of each process before it starts, where podman leaves them out: without root."""
        import resource

        if self._engine.name != "podman" or not self._engine.rootless:
            return
        self._client.post(f"{self._client.base_url}{LIBPOD}/{self._name}/init").raise_for_status()
        first = int(self._client.inspect_container(self._name)["State"]["Pid"])
        for limit in self._config["HostConfig"]["Ulimits"]:
            number = getattr(resource, f"RLIMIT_{limit['Name'].upper()}")
            resource.prlimit(first, number, (limit["Soft"], limit["Hard"]))

    def _follow(self, client: Any, stream: Any) -> None:
        """Pass on its output until it ends, and keep its exit status."""
        from docker.errors import DockerException

        with closing(client):
            try:
                for chunk in stream:
                    self._last_words.add(chunk)
                    self._output(chunk)
                status = self._exit_status(client)
                self._status = SIGNALS_FROM - status if SIGNALS_FROM < status <= SIGNALS_FROM + 64 else status
            except (DockerException, OSError) as error:  # those of requests are OSErrors
                self._failure = failed("follow the container", error)
            finally:
                self._ended.set()

    def _exit_status(self, client: Any) -> int:
        """Return its exit status once it has ended: its output may end before.

        The engine is not asked to wait: podman polls without a pause, at the cost of a whole processor, and
        holds the locks that its own monitor of the container needs to report the end.
        """
        pause_s, longest_s = POLLS_S
        while (state := client.inspect_container(self._name)["State"])["Status"] in RUNNING:
            time.sleep(pause_s)
            pause_s = min(1.5 * pause_s, longest_s)
        return int(state["ExitCode"])

    def _cannot_start(self, error: Any) -> BenchbotError:
        return BenchbotError(
            "The container cannot be started.",
            f"{self._engine.name} says: {error.explanation or error}",
            "Check the Dockerfile's CMD or ENTRYPOINT, and try 'podman run' or 'docker run' with the image: "
            f"{self._config['Image']}",
            exit_code=ExitCode.USAGE,
            failure=FailureClass.AGENT,
        )


def undisturbed(call: Callable[[], Result]) -> Result:
    """Return the result of `call`, which is finished even when an interrupt arrives: that is raised afterwards.

    Half a request would leave a container behind.
    """
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call).result()
