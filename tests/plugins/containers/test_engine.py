"""A podman of our own is there when it answers."""

import socket
import sys
from pathlib import Path

from benchbot.plugins.containers.engine import podman_service

SLOW = f"""\
#!{sys.executable}
import socket, sys, time
with socket.socket(socket.AF_UNIX) as there:
    there.bind(sys.argv[-1].removeprefix("unix://"))
    time.sleep(0.5)
    there.listen()
    time.sleep(1000)
"""


def test_a_socket_counts_once_somebody_listens_there(tmp_path: Path) -> None:
    program = tmp_path / "podman"
    program.write_text(SLOW)
    program.chmod(0o755)
    with podman_service(str(program)) as path, socket.socket(socket.AF_UNIX) as ours:
        ours.connect(str(path))
