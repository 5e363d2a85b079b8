import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path

import pytest

from benchbot.api.client import Client
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.wire import encoding
from benchbot.wire.run_state import Connection
from tests.supervisor.harness import eventually

Answering = Callable[[bytes], Client]

HEAD = b"HTTP/1.1 200 OK\r\nContent-Type: application/msgpack\r\n"


@pytest.fixture
def answering() -> Iterator[Answering]:
    """Makes a client of a server that answers to any request with the given bytes and hangs up."""
    with ExitStack() as stack:

        def make(answer: bytes) -> Client:
            listener = stack.enter_context(socket.create_server(("127.0.0.1", 0)))

            def serve() -> None:
                connection, _ = listener.accept()
                with connection:
                    connection.recv(65536)
                    connection.sendall(answer)

            thread = threading.Thread(target=serve)
            thread.start()
            stack.callback(thread.join)
            return Client(Connection(f"http://127.0.0.1:{listener.getsockname()[1]}", None, "token"))

        yield make


def test_an_answer_without_a_length_is_read_to_its_end(answering: Answering) -> None:
    assert answering(HEAD + b"\r\n" + encoding.encode({"steps": 3})).session() == {"steps": 3}


def test_an_answer_in_chunks_is_put_together(answering: Answering) -> None:
    body = encoding.encode({"steps": 3})
    chunks = b"".join(b"1\r\n%c\r\n" % byte for byte in body) + b"0\r\n\r\n"
    assert answering(HEAD + b"Transfer-Encoding: chunked\r\n\r\n" + chunks).session() == {"steps": 3}


@pytest.mark.parametrize(
    "answer",
    [
        b"",
        b"SSH-2.0-OpenSSH_9.6\r\n",
        HEAD + b"Content-Length: 100\r\n\r\nonly this",
        HEAD + b"Transfer-Encoding: chunked\r\n\r\nff\r\nonly this",
    ],
)
def test_an_answer_that_breaks_off_means_that_the_supervisor_is_gone(answering: Answering, answer: bytes) -> None:
    with pytest.raises(BenchbotError, match="supervisor is gone") as caught:
        answering(answer).session()
    assert caught.value.failure is FailureClass.INFRASTRUCTURE


@pytest.mark.parametrize(
    "answer",
    [
        b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: 4\r\n\r\n<ht>",
        b"HTTP/1.1 502 Bad Gateway\r\nContent-Type: text/html\r\nContent-Length: 0\r\n\r\n",
        b"HTTP/1.1 400 Bad\r\nContent-Type: application/json\r\nContent-Length: 2\r\n\r\n[]",
        b'HTTP/1.1 400 Bad\r\nContent-Type: application/json\r\nContent-Length: 13\r\n\r\n{"title": "a"}',
        HEAD + b"Content-Length: 1\r\n\r\n\x03",
    ],
)
def test_something_else_that_answers_is_told(answering: Answering, answer: bytes) -> None:
    with pytest.raises(BenchbotError, match="not a BenchBot supervisor"):
        answering(answer).session()


def test_a_request_over_the_cap_is_not_sent() -> None:
    client = Client(Connection("http://127.0.0.1:1", None, "token"))
    with pytest.raises(BenchbotError, match="too large") as caught:
        client.result({"results": b"\0" * (encoding.MAX_BODY_BYTES + 1)})
    assert caught.value.failure is FailureClass.AGENT


@pytest.mark.parametrize("token", ["to\nken", "token\r\nX-More: 1"])
def test_a_token_of_two_lines_is_not_sent(token: str) -> None:
    with pytest.raises(BenchbotError, match="line break"):
        Client(Connection("http://127.0.0.1:1", None, token)).health()


def test_a_connection_that_the_supervisor_ends_is_opened_anew() -> None:
    body = encoding.encode({"steps": 3})
    head = HEAD + b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(body)
    with socket.create_server(("127.0.0.1", 0)) as listener, ExitStack() as stack:

        def serve() -> None:
            for _ in range(2):
                connection = stack.enter_context(listener.accept()[0])
                connection.recv(65536)
                connection.sendall(head + body)

        thread = threading.Thread(target=serve)
        thread.start()
        client = Client(Connection(f"http://127.0.0.1:{listener.getsockname()[1]}", None, "token"))
        assert [client.session(), client.session()] == [{"steps": 3}, {"steps": 3}]
        thread.join()


def test_a_connection_that_was_closed_while_nothing_was_asked_is_opened_anew() -> None:
    """As a supervisor closes idle ones when it has too many: a solution must not fail by that, nor who submits it."""
    body = encoding.encode({"steps": 3})
    with socket.create_server(("127.0.0.1", 0)) as listener, ExitStack() as stack:
        asked: list[bytes] = []

        def serve() -> None:
            for _ in range(2):
                with listener.accept()[0] as connection:
                    asked.append(connection.recv(65536)[:20])
                    connection.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % len(body) + body)
                closed.release()

        closed = threading.Semaphore(0)
        thread = threading.Thread(target=serve)
        thread.start()
        stack.callback(thread.join)
        client = Client(Connection(f"http://127.0.0.1:{listener.getsockname()[1]}", None, "token"))
        assert client.session() == {"steps": 3}
        closed.acquire()
        assert client.step(None) == {"steps": 3}
        assert asked == [b"GET /api/v1/session ", b"POST /api/v1/step HT"]


def test_a_client_waits_while_a_unix_socket_takes_no_more(tmp_path: Path) -> None:
    body = encoding.encode({"steps": 3})
    with socket.socket(socket.AF_UNIX) as listener, ExitStack() as stack:
        listener.bind(str(tmp_path / "s"))
        listener.listen(0)
        crowd = stack.enter_context(socket.socket(socket.AF_UNIX))
        crowd.connect(str(tmp_path / "s"))
        with ThreadPoolExecutor(1) as executor:
            answer = executor.submit(Client(Connection(None, str(tmp_path / "s"), "token")).session)
            # Nobody else comes in, either.
            assert eventually(lambda: not answer.done() and is_full(tmp_path / "s"))
            listener.accept()[0].close()
            with listener.accept()[0] as connection:
                connection.recv(65536)
                connection.sendall(HEAD + b"Content-Length: %d\r\n\r\n" % len(body) + body)
                assert answer.result() == {"steps": 3}


def is_full(path: Path) -> bool:
    with socket.socket(socket.AF_UNIX) as client:
        client.setblocking(False)
        try:
            client.connect(str(path))
        except BlockingIOError:
            return True
        return False


def test_an_answer_that_comes_byte_by_byte_is_put_together() -> None:
    body = encoding.encode({"steps": 3})
    answer = HEAD + b"Content-Length: %d\r\n\r\n" % len(body) + body
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            connection, _ = listener.accept()
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with connection:
                for _ in range(2):
                    connection.recv(65536)
                    for number in range(len(answer)):
                        connection.sendall(answer[number : number + 1])

        thread = threading.Thread(target=serve)
        thread.start()
        client = Client(Connection(f"http://127.0.0.1:{listener.getsockname()[1]}", None, "token"))
        assert [client.session(), client.session()] == [{"steps": 3}, {"steps": 3}]
        thread.join()


def test_nobody_at_the_address_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(BenchbotError, match="supervisor is gone") as caught:
        Client(Connection(f"http://127.0.0.1:{port}", None, "token")).health()
    assert str(port) in caught.value.why
