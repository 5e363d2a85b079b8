"""A solution that uses up the supervisor's connections: who has submitted it sees how it ends, and it has failed."""

import sys
from pathlib import Path

import pytest

from benchbot.submission.modes import NATIVE, SolutionSpec
from tests.submission.submitting import back_end, submit

CROWDS = """
import os, socket, sys, time
mine = "Host: localhost\\r\\nAuthorization: Bearer " + os.environ["BENCHBOT_TOKEN"] + "\\r\\n"
beginnings = {
    "silent connections": "",
    "idle connections": "GET /api/v1/session HTTP/1.1\\r\\n" + mine + "\\r\\n",
    "halves of heads": "GET /api/v1/session HTTP/1.1\\r\\n",
    "streams that nobody reads": "GET /api/v1/events HTTP/1.1\\r\\n" + mine + "\\r\\n",
    "bodies that do not end": "POST /api/v1/result HTTP/1.1\\r\\n" + mine + "Content-Length: 9\\r\\n\\r\\n{",
}
held = []
until_s = time.monotonic() + 1  # for the one who watches to look meanwhile
while len(held) < 700 or time.monotonic() < until_s:
    connection = socket.socket(socket.AF_UNIX)
    connection.connect(os.environ["BENCHBOT_SOCKET"])
    try:
        connection.sendall(beginnings[sys.argv[1]].encode())
    except OSError:
        pass
    held.append(connection)
    del held[:-900]
sys.exit(3)
"""


@pytest.mark.parametrize(
    "how",
    [
        "silent connections",
        "idle connections",
        "halves of heads",
        "streams that nobody reads",
        "bodies that do not end",
    ],
)
def test_who_crowds_the_supervisor_has_failed_by_itself(tmp_path: Path, how: str) -> None:
    (tmp_path / "crowds.py").write_text(CROWDS)
    with back_end() as backend:
        command = [sys.executable, "-I", "-S", "crowds.py", how]
        ended, spectator = submit(SolutionSpec(command, tmp_path, {}, 60, NATIVE), backend)
    failure = ended.document["provenance"]["failure"]
    assert failure["class"] == "agent", (failure, spectator.text)
    assert "exit status 3" in failure["why"]
