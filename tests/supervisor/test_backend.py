import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from benchbot.api.client import Client
from benchbot.core import resources
from benchbot.core.errors import BenchbotError, ExitCode, FailureClass
from benchbot.core.request import Limits, RunRequest
from benchbot.process import is_running
from benchbot.supervisor import backend as backends
from benchbot.supervisor.backend import Backend
from benchbot.supervisor.http import server
from benchbot.wire import run_state
from tests.supervisor.harness import alive, children_of, eventually

SERVE = """
import json, os, sys
from pathlib import Path
from benchbot.supervisor.serve import serve
from tests.supervisor.harness import sample_selection

def ready(state):
    print(json.dumps(state.as_dict()), flush=True)

socket = Path(sys.argv[1]) if len(sys.argv) > 1 else None
ended_by = serve(sample_selection(), port=0, unix_socket=socket, on_ready=ready)
print(None if ended_by is None else ended_by.name)
"""


@pytest.fixture
def short_folder() -> Iterator[Path]:
    """A folder whose path is short enough for unix sockets."""
    import tempfile

    with tempfile.TemporaryDirectory(prefix="bb-") as folder:
        yield Path(folder)


def start_serving(*arguments: str) -> tuple["subprocess.Popen[str]", dict[str, Any]]:
    command = [sys.executable, "-c", SERVE, *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, json.loads(process.stdout.readline())


def client_of(state: dict[str, Any]) -> Client:
    return Client(run_state.Connection(**state["connection"]))


def files_of(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_leaves_nothing_behind(number: signal.Signals, short_folder: Path) -> None:
    socket = short_folder / "socket"
    process, state = start_serving(str(socket))
    client = client_of(state)
    client.reset()
    (child,) = children_of(state["pid"])
    assert alive(child)
    process.send_signal(number)
    said, _ = process.communicate(timeout=30)
    assert said.strip() == number.name
    assert process.returncode == 0
    assert not alive(child)
    assert not socket.exists()
    assert files_of(resources.state_dir()) == []
    with pytest.raises(BenchbotError, match="gone"):
        client.step("move_next")


def test_a_client_can_end_a_run() -> None:
    process, state = start_serving()
    client_of(state).stop()
    said, _ = process.communicate(timeout=30)
    assert said.strip() == "None"
    assert files_of(resources.state_dir()) == []


def test_a_killed_supervisor_takes_its_platform_along() -> None:
    process, state = start_serving()
    client = client_of(state)
    client.reset()
    (child,) = children_of(state["pid"])
    process.kill()
    process.communicate()
    assert eventually(lambda: not alive(child))
    with pytest.raises(BenchbotError, match="supervisor is gone") as caught:
        client.step("move_next")
    assert caught.value.failure is FailureClass.INFRASTRUCTURE
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert run_state.live() == []


def test_a_result_stays_when_the_run_has_ended() -> None:
    process, state = start_serving()
    client = client_of(state)
    client.reset()
    client.failed(FailureClass.AGENT, "It did not want to.")
    client.stop()
    process.communicate(timeout=30)
    document = json.loads(Path(state["result"]).read_text("utf-8"))
    assert document["provenance"]["failure"] == {"class": "agent", "why": "It did not want to."}


def test_both_addresses_lead_to_the_same_run(short_folder: Path) -> None:
    process, state = start_serving(str(short_folder / "socket"))
    connection = run_state.Connection(**state["connection"])
    over_tcp = Client(run_state.Connection(connection.url, None, connection.token))
    over_unix = Client(run_state.Connection(None, connection.socket, connection.token))
    over_tcp.reset()
    assert over_unix.step("move_next")["steps"] == 1
    assert over_tcp.session()["steps"] == 1
    over_tcp.stop()
    process.communicate(timeout=30)


def request(**changes: Any) -> RunRequest:
    return RunRequest(**{"task": "sample:passive", "robot": "sample_robot", "environment": "arena:1", **changes})


def sample_backend(port: int | None = 0, unix_socket: Path | None = None, **changes: Any) -> Any:
    return Backend.start(request(**changes), port=port, unix_socket=unix_socket)


def test_a_back_end_is_there_while_it_is_needed() -> None:
    with sample_backend(seed=4, limits=Limits(steps=2)) as backend:
        client = Client(backend.state.connection)
        assert client.health()["pid"] == backend.state.pid
        selection = client.session()["selection"]
        assert (backend.state.seed, selection["limits"]["steps"]) == (4, 2)
        assert backend.died() is None
        assert run_state.live() == [backend.state]
    assert not alive(backend.state.pid)
    assert files_of(resources.state_dir()) == []


@pytest.mark.parametrize(
    "sent", [b"no HTTP at all\r\n\r\n", b"GET / HTTP/1.1\r\nHost: a\r\nConnection: Upgrade\r\nUpgrade: x\r\n\r\n"]
)
def test_what_strangers_send_does_not_fill_the_log(sent: bytes) -> None:
    with Backend.start(RunRequest("sample:passive", "sample_robot", "arena:1"), port=0) as backend:
        log = Path(backend.state.supervisor_log)
        before = log.stat().st_size
        host, _, port = str(backend.state.connection.url).removeprefix("http://").partition(":")
        for _ in range(20):
            with socket.create_connection((host, int(port)), 60) as client:
                client.sendall(sent)
                assert client.recv(100).startswith(b"HTTP/1.1 ")
        assert log.stat().st_size == before


def test_a_warm_back_end_begins_one_run_after_another() -> None:
    with sample_backend(seed=4) as backend:
        first = backend.state
        client = Client(first.connection)
        client.reset()
        client.step("move_next")
        client.failed(FailureClass.AGENT, "It did not want to.")
        (simulator,) = children_of(backend.pid)

        backend.begin(request(seed=5, limits=Limits(steps=1)))

        assert backend.state.connection.url == first.connection.url
        assert backend.state.result != first.result
        assert json.loads(Path(first.result).read_text("utf-8"))["provenance"]["failure"]["class"] == "agent"
        with pytest.raises(BenchbotError, match="does not know you"):
            client.step("move_next")
        client = Client(backend.state.connection)
        assert (backend.state.seed, client.session()["steps"]) == (5, 0)
        assert client.session()["progress"]["failure"] is None
        client.reset()
        client.step("move_next")
        assert children_of(backend.pid) == [simulator], "it is the same simulator"
        assert run_state.live() == [backend.state]
    assert run_state.live() == []


def test_a_warm_back_end_begins_anew_where_the_next_episode_starts() -> None:
    with sample_backend(task="sample:goal", episode=0) as backend:
        starts = []
        for number in (0, 1, 0):
            backend.begin(request(task="sample:goal", episode=number))
            observations = Client(backend.state.connection).reset()["observations"]
            starts.append(observations["poses"]["base_link"]["translation_xyz"].tolist())
    assert starts[0] == starts[2] != starts[1]


def test_a_warm_back_end_replaces_a_simulator_that_has_died() -> None:
    with sample_backend() as backend:
        client = Client(backend.state.connection)
        client.reset()
        (simulator,) = children_of(backend.pid)
        os.kill(simulator, signal.SIGKILL)
        assert eventually(lambda: not alive(simulator))
        backend.begin(request(seed=1))
        assert Client(backend.state.connection).reset()["state"] == "clean"


def test_a_run_that_is_not_possible_leaves_the_one_before() -> None:
    with sample_backend() as backend:
        before = backend.state
        with pytest.raises(BenchbotError, match="has no episodes"):
            backend.begin(request(episode=3))
        assert Client(before.connection).reset()["state"] == "clean"
        backend.begin(request(seed=1))
        assert Client(backend.state.connection).reset()["state"] == "clean"


def test_an_impossible_selection_is_told_as_it_is() -> None:
    with pytest.raises(BenchbotError, match="not a known task") as caught, sample_backend(task="sample:pasive"):
        pass
    assert "sample:passive" in caught.value.why
    assert caught.value.exit_code is ExitCode.USAGE


def test_a_taken_port_is_told() -> None:
    with server.bind_tcp("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(BenchbotError, match=f"Cannot listen on 127.0.0.1:{port}"), sample_backend(port=port):
            pass
    assert files_of(resources.state_dir()) == []


def test_a_port_that_a_run_of_ones_own_has_is_told_with_its_name() -> None:
    with sample_backend() as backend:
        port = int((backend.state.connection.url or "").rpartition(":")[2])
        with pytest.raises(BenchbotError) as caught, sample_backend(port=port):
            pass
        assert f"benchbot stop --run {backend.state.name}; or take any free port: --port 0" in caught.value.fix


def test_a_back_end_that_dies_is_told() -> None:
    with sample_backend() as backend:
        os.kill(backend.state.pid, signal.SIGKILL)
        assert eventually(lambda: backend.died() is not None)
        error = backend.died()
    assert "SIGKILL" in error.why
    assert error.failure is FailureClass.INFRASTRUCTURE


def test_a_back_end_that_is_too_slow_to_end_is_tidied_up_after(
    short_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(backends, "STOP_TIMEOUT_S", 0.1)
    with sample_backend(unix_socket=short_folder / "socket") as backend:
        children = [backend.pid, *children_of(backend.pid)]
        # A machine that is very busy, or swaps, looks just like this.
        os.kill(backend.pid, signal.SIGSTOP)
    assert eventually(lambda: not any(alive(child) for child in children))
    assert run_state.live() == []
    assert not Path(backend.state.folder, "run.json").exists()
    assert list(short_folder.iterdir()) == []


def test_a_back_end_that_hangs_says_where_and_its_recordings_are_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(backends, "CLOSE_TIMEOUT_S", -backends.STOP_TIMEOUT_S + 0.01)
    with sample_backend(record={"steps": tmp_path / "steps"}) as backend:
        Client(backend.state.connection).reset()
        children = children_of(backend.pid)
    assert not any(is_running(child) for child in children)
    assert "did not end in 0.01 s and was ended by force" in caplog.text
    assert "Current thread" in caplog.text
    assert list((tmp_path / "steps").iterdir())


def test_a_back_end_ends_with_the_process_that_started_it() -> None:
    code = (
        "import os, signal\n"
        "from benchbot.supervisor.backend import Backend\n"
        "from benchbot.core.request import RunRequest\n"
        "start = Backend.start(RunRequest('sample:passive', 'sample_robot', 'arena:1'))\n"
        "with start as backend:\n"
        "    print(backend.state.pid, flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    pid = int(done.stdout)
    assert eventually(lambda: not alive(pid))
    assert files_of(resources.state_dir()) == []
