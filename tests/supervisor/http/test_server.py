import socket
import stat
from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.supervisor.http import server


def test_port_zero_is_any_free_port() -> None:
    with server.bind_tcp("127.0.0.1", 0) as one, server.bind_tcp("localhost", 0) as other:
        assert one.getsockname()[1] != other.getsockname()[1]
        assert server.url_of(one) == f"http://127.0.0.1:{one.getsockname()[1]}"


def test_a_taken_port_is_named_with_the_way_out() -> None:
    with server.bind_tcp("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(BenchbotError) as caught:
            server.bind_tcp("127.0.0.1", port)
    assert f"127.0.0.1:{port}" in caught.value.title
    assert "in use" in caught.value.why
    assert "--port 0" in caught.value.fix


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "example.org", ""])
def test_an_address_that_others_can_reach_is_refused(host: str) -> None:
    with pytest.raises(BenchbotError, match="other machines"):
        server.bind_tcp(host, 0)


def test_an_address_that_others_can_reach_must_be_asked_for_in_so_many_words() -> None:
    with server.bind_tcp("0.0.0.0", 0, allow_remote=True) as listener:
        assert listener.getsockname()[0] == "0.0.0.0"


def test_a_unix_socket_is_private(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "socket"
    with server.bind_unix(path):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700


def test_a_dead_supervisors_socket_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "socket"
    server.bind_unix(path).close()
    with server.bind_unix(path), socket.socket(socket.AF_UNIX) as client:
        client.connect(str(path))


def test_a_living_supervisors_socket_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "socket"
    with server.bind_unix(path), pytest.raises(BenchbotError) as caught:
        server.bind_unix(path)
    assert "Another supervisor listens there" in caught.value.why


def test_a_file_is_never_taken_for_a_socket(tmp_path: Path) -> None:
    path = tmp_path / "thesis.tex"
    path.write_text("years of work")
    with pytest.raises(BenchbotError, match=r"thesis\.tex"):
        server.bind_unix(path)
    assert path.read_text() == "years of work"


def test_a_path_too_long_for_a_socket_is_told(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError) as caught:
        server.bind_unix(tmp_path / ("x" * 200))
    assert "too long" in caught.value.why
    assert list(tmp_path.iterdir()) == []


def test_connections_notice_when_the_network_is_gone() -> None:
    with server.bind_tcp("127.0.0.1", 0) as listener, socket.create_connection(listener.getsockname()):
        accepted, _ = listener.accept()
        with accepted:
            assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE) == 1
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE) == 1
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT) == server.PROBES
