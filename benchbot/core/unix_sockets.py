"""Unix sockets as files: one that is there may have nobody behind it, yet or any more."""

import socket
from pathlib import Path


def somebody_listens(path: Path) -> bool:
    """Say whether a connection to the unix socket at a path is taken; raises OSError where it may not be tried."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(str(path))
        except (FileNotFoundError, ConnectionRefusedError):
            return False
    return True
