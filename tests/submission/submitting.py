"""Helpers of the tests of submission modes: a back end on a unix socket, and a watcher."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from benchbot.core.errors import BenchbotError
from benchbot.core.request import RunRequest
from benchbot.submission import episode
from benchbot.submission.episode import EndedEpisode
from benchbot.submission.modes import SolutionSpec, private_socket
from benchbot.supervisor.backend import Backend


@dataclass
class Spectator:
    """Keeps what a solution prints, and the number of its process."""

    output: bytearray = field(default_factory=bytearray)
    process: int = 0

    @property
    def text(self) -> str:
        """The output as text."""
        return self.output.decode()

    def write(self, chunk: bytes) -> None:
        """Keep what it prints."""
        self.output += chunk

    def started(self, process: int) -> None:
        """Keep its number."""
        self.process = process

    def look(self, progress: Mapping[str, Any], scene_count: int) -> BenchbotError | None:
        """Let it go on."""


@contextmanager
def back_end() -> Iterator[Backend]:
    """Yield a back end on a unix socket alone, with the sample simulator."""
    with (
        private_socket() as socket,
        Backend.start(
            RunRequest("sample:passive", "sample_robot", "arena:1"), port=None, unix_socket=socket
        ) as backend,
    ):
        yield backend


def submit(spec: SolutionSpec, backend: Backend) -> tuple[EndedEpisode, Spectator]:
    """Run a solution; return how its episode ended, and who has looked on."""
    spectator = Spectator()
    return episode.run(spec, backend.state.connection, backend.died, spectator, state=backend.state), spectator
