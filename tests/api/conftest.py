from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.request import RunRequest
from benchbot.supervisor.backend import Backend
from benchbot.wire.run_state import RUN


@pytest.fixture(autouse=True)
def _folders_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    for name in ("BENCHBOT_URL", "BENCHBOT_SOCKET", "BENCHBOT_TOKEN", "BENCHBOT_RUN", "BENCHBOT_RESULT"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def start_backend() -> Iterator[Callable[..., Backend]]:
    """Starts a back end that runs until the end of the test; the solution finds it as on any machine."""
    with ExitStack() as stack:

        def start(
            task: str = "sample:passive",
            environment: str = "arena:1",
            robot: str = "sample_robot",
            seed: int = 0,
            **more: Any,
        ) -> Backend:
            chosen = Backend.start(RunRequest(task, robot, environment, seed), **{"owner": RUN, **more})
            return stack.enter_context(chosen)

        yield start
