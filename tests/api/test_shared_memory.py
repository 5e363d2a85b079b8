"""Observations through shared memory: the same by every way, nothing left behind, and no trust in what is told."""

import gc
import os
import signal
import socket
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchbot.api.client import Client, SharedMemory
from benchbot.core import resources
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.supervisor.backend import Backend
from benchbot.wire import arena, encoding
from benchbot.wire.run_state import Connection
from tests.supervisor.harness import alive, children_of, eventually
from tests.wire.test_arena import write

StartBackend = Callable[..., Backend]


def client_of(backend: Backend, **more: Any) -> Client:
    return Client(backend.state.connection, **more)


def shares(client: Client) -> bool:
    """Say whether a client has opened an arena."""
    return client._memory is not None


def arenas_of(pid: int) -> list[str]:
    """Return the arenas that a process holds open or mapped."""
    links = [str(path.readlink()) for path in Path(f"/proc/{pid}/fd").iterdir() if path.is_symlink()]
    mapped = Path(f"/proc/{pid}/maps").read_text("utf-8").splitlines()
    return [text for text in (*links, *mapped) if arena.NAME in text]


def test_observations_are_the_same_by_every_way(start_backend: StartBackend, tmp_path: Path) -> None:
    connection = start_backend("sample:active", unix_socket=tmp_path / "s", port=0).state.connection
    over_tcp = Connection(connection.url, None, connection.token)
    over_unix = Connection(None, connection.socket, connection.token)
    clients = [Client(way, shares_memory=shared) for way in (over_tcp, over_unix) for shared in (False, True)]
    clients[0].reset()
    for client in clients:
        client.step(None)
    moved = clients[1].step("move_distance", {"distance": 0.5})
    assert [shares(client) for client in clients] == [False, True, False, True]
    for client in clients:
        np.testing.assert_equal(client.step(None)["observations"], moved["observations"])


def test_what_was_shared_is_the_solutions_to_keep_and_to_write_on(start_backend: StartBackend) -> None:
    client = client_of(start_backend("sample:active"))
    client.reset()
    first = client.step(None)["observations"]
    kept = first["image_rgb"].copy()
    second = client.step("move_angle", {"angle": 90.0})["observations"]
    assert shares(client)
    assert not np.array_equal(first["image_rgb"], second["image_rgb"])
    np.testing.assert_array_equal(first["image_rgb"], kept)
    first["image_rgb"] += 1


def test_the_digest_is_the_same_by_every_way(start_backend: StartBackend) -> None:
    def digest(**more: Any) -> str:
        client = client_of(start_backend("sample:active", seed=3), **more)
        client.reset()
        for distance in (0.2, 0.3, -0.1):
            client.step("move_distance", {"distance": distance})
        document = client.failed(FailureClass.AGENT, "Enough.")["document"]
        return str(document["provenance"]["observation_digest"])

    assert digest(shares_memory=True) == digest(shares_memory=False)


def test_a_new_platform_has_a_new_arena(start_backend: StartBackend) -> None:
    backend = start_backend("sample:active")
    client = client_of(backend)
    client.reset()
    client.step(None)
    before = client._memory
    (platform,) = children_of(backend.state.pid)
    os.kill(platform, signal.SIGKILL)
    with pytest.raises(BenchbotError, match="The simulator died"):
        client.step("move_distance", {"distance": 0.1})
    first = client.reset()["observations"]
    np.testing.assert_equal(client.step(None)["observations"], first)
    assert shares(client)
    assert client._memory is not before


def test_one_who_reads_slowly_asks_again(start_backend: StartBackend, monkeypatch: pytest.MonkeyPatch) -> None:
    backend = start_backend("sample:active")
    slow, quick = client_of(backend), client_of(backend)
    slow.reset()
    read = SharedMemory.read

    def read_slowly(memory: SharedMemory, *where: Any) -> Any:
        if quick.session()["steps"] == 1:
            quick.step("move_angle", {"angle": 90.0})
        return read(memory, *where)

    monkeypatch.setattr(SharedMemory, "read", read_slowly)
    answer = slow.step("move_distance", {"distance": 0.5})
    assert (answer["outcome"], answer["steps"]) == ("reached", 2)
    np.testing.assert_equal(answer["observations"], quick.step(None)["observations"])


def test_an_arena_that_cannot_be_reached_is_done_without(
    start_backend: StartBackend, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_arguments: Any, **_more: Any) -> int:
        raise PermissionError

    client = client_of(start_backend())
    with monkeypatch.context() as patch:
        patch.setattr("benchbot.api.client.os.open", refuse)
        first = client.reset()["observations"]
    assert not shares(client)
    np.testing.assert_equal(client.step(None)["observations"], first)
    assert not shares(client)


@pytest.fixture
def offered() -> Iterator[dict[str, Any]]:
    """An offer of an arena of this process."""
    handle = arena.create()
    write(arena.ArenaWriter(handle), [np.arange(3, dtype="<u2")])
    yield {"pid": os.getpid(), "descriptor": handle, "nonce": arena.ArenaReader(handle).nonce}
    os.close(handle)


def test_an_offered_arena_is_opened_for_reading_only(offered: dict[str, Any]) -> None:
    memory = SharedMemory.open(offered)
    assert memory is not None
    array = memory.read("<u2", [3], 64)
    assert array.tolist() == [0, 1, 2]
    memory.close()
    assert os.fstat(offered["descriptor"]).st_mode & 0o777 == 0o400


@pytest.mark.parametrize(
    "changed",
    [
        {"nonce": "00" * 16},
        {"pid": 2**30},
        {"pid": "1/../self"},
        {"descriptor": 2**20},
        {"descriptor": "../environ"},
        {"pid": None},
    ],
)
def test_what_is_not_the_offered_arena_is_not_opened(offered: dict[str, Any], changed: dict[str, Any]) -> None:
    before = Counter(arenas_of(os.getpid()))
    assert SharedMemory.open({**offered, **changed}) is None
    assert SharedMemory.open(3) is None
    assert Counter(arenas_of(os.getpid())) <= before


def test_another_file_than_an_arena_is_never_opened(offered: dict[str, Any], tmp_path: Path) -> None:
    with (tmp_path / "secret").open("wb+") as secret:
        secret.write(bytes.fromhex(offered["nonce"]) + bytes(100))
        secret.flush()
        assert SharedMemory.open({**offered, "descriptor": secret.fileno()}) is None


@contextmanager
def answering(*answers: dict[str, Any] | bytes) -> Iterator[Client]:
    """Yield the client of a server that gives these answers, whatever it is asked."""
    with ExitStack() as stack:
        listener = stack.enter_context(socket.create_server(("127.0.0.1", 0)))

        def serve() -> None:
            connection, _ = listener.accept()
            with connection:
                for answer in answers:
                    connection.recv(65536)
                    body = answer if isinstance(answer, bytes) else encoding.encode(answer)
                    head = "HTTP/1.1 200 OK\r\nContent-Type: application/msgpack\r\nContent-Length: %d\r\n\r\n"
                    connection.sendall((head % len(body)).encode() + body)

        thread = threading.Thread(target=serve)
        thread.start()
        stack.callback(thread.join)
        yield Client(Connection(f"http://127.0.0.1:{listener.getsockname()[1]}", None, "token"))


def placed(nonce: str, sequence: int, offset: int) -> bytes:
    lent = np.zeros(3, "<u2")
    answer = {"observations": {"a": lent}, "outcome": None, "arena": {"nonce": nonce, "sequence": sequence}}
    return encoding.encode(answer, lambda array: offset)


def test_an_answer_may_not_name_another_arena(offered: dict[str, Any]) -> None:
    with answering({"arena": offered}, placed("ff" * 16, 2, 64)) as client:
        client.reset()
        with pytest.raises(BenchbotError, match="memory that this client has not opened"):
            client.step(None)


def test_an_answer_may_not_lead_outside_of_the_arena(offered: dict[str, Any]) -> None:
    with answering({"arena": offered}, placed(offered["nonce"], 2, 2**40)) as client:
        client.reset()
        with pytest.raises(BenchbotError, match="cannot be read") as caught:
            client.step(None)
    assert "ends at byte" in caught.value.why


def test_places_without_an_arena_are_told() -> None:
    with answering(placed("ff" * 16, 2, 64)) as client, pytest.raises(BenchbotError, match="cannot be read"):
        client.reset()


def test_an_offer_that_leads_nowhere_is_ignored() -> None:
    offer = {"pid": 2**30, "descriptor": 3, "nonce": "00" * 16}
    with answering({"steps": 0, "arena": offer}, {"steps": 1}) as client:
        assert client.reset() == {"steps": 0}
        assert client.step(None) == {"steps": 1}


SOLUTION = """
import time
from benchbot.api.client import Client
client = Client()
client.reset()
client.step(None)
assert client._memory is not None
print("sharing", flush=True)
time.sleep(60)
"""


def files_left() -> set[Path]:
    """Return what the runs of this user have on disk and under a name in shared memory."""
    return {*resources.state_dir().rglob("*"), *Path("/dev/shm").glob("*benchbot*")}


@pytest.mark.parametrize("killed", ["client", "platform", "supervisor"])
def test_whoever_is_killed_nothing_is_left(start_backend: StartBackend, killed: str) -> None:
    backend = start_backend()
    files_before = files_left()
    (platform,) = children_of(backend.state.pid)
    command = [sys.executable, "-c", SOLUTION]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as solution:
        assert solution.stdout is not None
        assert solution.stdout.readline() == "sharing\n"
        assert arenas_of(solution.pid)
        pids = {"client": solution.pid, "platform": platform, "supervisor": backend.state.pid}
        os.kill(pids[killed], signal.SIGKILL)
        assert eventually(lambda: not alive(pids[killed]))
        if killed == "supervisor":
            assert eventually(lambda: not alive(platform))
        solution.kill()
    assert files_left() <= files_before


def test_a_client_that_is_forgotten_lets_go_of_the_memory(start_backend: StartBackend) -> None:
    backend = start_backend()
    gc.collect()
    before = len(arenas_of(os.getpid()))
    for closed in (True, False):
        client = client_of(backend)
        client.reset()
        client.step(None)
        assert len(arenas_of(os.getpid())) > before
        if closed:
            client.close()
            client.close()
        del client
        gc.collect()
        assert len(arenas_of(os.getpid())) == before
