"""A socket's file does not mean that anybody listens."""

import socket
from pathlib import Path

import pytest

from benchbot.core.unix_sockets import somebody_listens


def test_a_socket_counts_from_its_first_listener_to_its_last(tmp_path: Path) -> None:
    path = tmp_path / "there.sock"
    assert not somebody_listens(path)
    with socket.socket(socket.AF_UNIX) as there:
        there.bind(str(path))
        assert not somebody_listens(path)
        there.listen()
        assert somebody_listens(path)
    assert path.is_socket()
    assert not somebody_listens(path)


def test_what_is_no_place_for_a_socket_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="Not a directory"):
        somebody_listens(tmp_path / "file" / "there.sock")
