"""The import name of BenchBot v2: `benchbot.api.BenchBot`, with what scripts of v2 used of its client besides."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from functools import cache, wraps
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from benchbot import api
from benchbot.api.agent import ActionResult, Agent
from benchbot.api.benchbot import result_location
from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    RESULT_LOCATION: str

__all__ = ["DEFAULT_ADDRESS", "DEFAULT_PORT", "RESULT_LOCATION", "TIMEOUT_SUPERVISOR", "ActionResult", "BenchBot"]

DEFAULT_ADDRESS = "benchbot_supervisor"
DEFAULT_PORT = 10000
TIMEOUT_SUPERVISOR = 60


class BenchBot(api.BenchBot):
    """The robot in a task, as `benchbot.api.BenchBot`; v2's own name for its supervisor means the run that is there.

    Where v2 raised `requests.ConnectionError`, an error is one of these as well, if the solution has imported requests.
    """

    class RouteType(Enum):
        """The parts of v2's supervisor."""

        CONNECTION = (0,)
        CONFIG = (1,)
        ROBOT = (2,)
        RESULTS = (3,)
        EXPLICIT = 4

    ROUTE_MAP = {  # noqa: RUF012 - as v2 has it
        RouteType.CONNECTION: "connections",
        RouteType.CONFIG: "config",
        RouteType.ROBOT: "robot",
        RouteType.RESULTS: "results_functions",
        RouteType.EXPLICIT: "",
    }

    def __init__(
        self, agent: Agent | None = None, supervisor_address: str | None = None, auto_start: bool = True
    ) -> None:
        """Connect to the run of this process, or the only one of this user, or to `supervisor_address`."""
        self.supervisor_address = supervisor_address or f"http://{DEFAULT_ADDRESS}:{DEFAULT_PORT}/"
        is_default = urlsplit(self.supervisor_address).hostname == DEFAULT_ADDRESS
        super().__init__(agent, None if is_default else supervisor_address, auto_start)

    def start(self) -> None:
        """Connect to the supervisor and begin a new episode in the start of the first scene."""
        with _errors_of_v2():
            super().start()

    def results_functions(self) -> dict[str, Callable[..., Any]]:
        """Return the functions of the task's results format by name (`create`, `create_object`, `validate`, …)."""
        return {name: _raising_as_v2(function) for name, function in super().results_functions().items()}

    def _request(self, ask: Callable[[], dict[str, Any]]) -> None:
        with _errors_of_v2():
            super()._request(ask)


def _raising_as_v2(function: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        with _errors_of_v2():
            return function(*args, **kwargs)

    return call


@contextmanager
def _errors_of_v2() -> Iterator[None]:
    try:
        yield
    except (ValueError, RuntimeError):
        raise
    except BenchbotError as error:
        requests = sys.modules.get("requests")
        if requests is None or isinstance(error, requests.ConnectionError):
            raise
        kind = _connection_error(requests.ConnectionError)
        code, failure = error.exit_code, error.failure
        found = kind(error.title, error.why, error.fix, exit_code=code, failure=failure, ends_run=error.ends_run)
        raise found from error.__cause__


@cache
def _connection_error(base: type[Exception]) -> type[BenchbotError]:
    """Return the class of our errors that are v2's as well; requests is no dependency of a solution's."""
    return type("SupervisorConnectionError", (BenchbotError, base), {})


def __getattr__(name: str) -> Any:
    # Looked up when it is asked for: BENCHBOT_RESULT may be set after the import.
    if name == "RESULT_LOCATION":
        return result_location()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
