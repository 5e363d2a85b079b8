from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from benchbot.core.host import Host
from benchbot.core.selection import Selection
from benchbot.supervisor.http import server
from benchbot.supervisor.http.app import create_app
from benchbot.supervisor.platform.host import ChildHost, Timeouts
from benchbot.supervisor.run import Run
from tests.supervisor.harness import OPERATOR_TOKEN, TOKEN, Served, sample_selection


@pytest.fixture(autouse=True)
def _folders_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BENCHBOT_STATE_DIR", str(tmp_path / "state"))
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    for name in ("BENCHBOT_URL", "BENCHBOT_SOCKET", "BENCHBOT_TOKEN", "BENCHBOT_RUN", "BENCHBOT_RESULT"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def serve(tmp_path: Path) -> Iterator[Callable[..., Served]]:
    """Serves a selection on a free port, its platform in a real child process."""
    with ExitStack() as stack:

        def start(
            selection: Selection | None = None, timeouts: Timeouts | None = None, *, open_to_v2: bool = False
        ) -> Served:
            chosen = selection or sample_selection()
            hosts: list[ChildHost] = []

            def start_host() -> Host:
                log = tmp_path / "platform.log"
                hosts.append(ChildHost(chosen, log, timeouts=timeouts, operator=run.operator, zero_copy=True))
                return hosts[-1]

            run = Run(chosen, start_host, tmp_path / "result.json")
            listener = stack.enter_context(server.bind_tcp("127.0.0.1", 0))
            app = create_app(run, TOKEN, OPERATOR_TOKEN, open_to_v2=open_to_v2)
            stack.enter_context(server.Server(app, [listener]))
            stack.callback(run.close)
            return Served(run, server.url_of(listener), hosts)

        yield start
