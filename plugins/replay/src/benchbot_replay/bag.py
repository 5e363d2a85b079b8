"""A ROS 2 bag, and what has to be said of it to make steps of its messages."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError, Declaration

FOLDER = "Name the folder that ros2 bag record has written, with its metadata.yaml."


@dataclass(frozen=True)
class Bag:
    """A bag, and what is said of it: the robot whose topics it holds, the task and the place.

    A step is `every_s` seconds after the one before, at least.
    """

    path: Path
    robot: Declaration
    task: Declaration
    environment: Declaration
    every_s: float = 0.0

    def refused(self, why: str, fix: str = FOLDER) -> BenchbotError:
        """Return the error of a bag that no recording can be made of."""
        return BenchbotError(f"The bag {self.path} cannot be replayed.", why, fix)

    def content_sha256(self) -> str:
        """Return the SHA-256 over the SHA-256 of its files, by their names."""
        files = sorted(one for one in self.path.rglob("*") if one.is_file()) if self.path.is_dir() else [self.path]
        digest = sha256()
        for file in files:
            with file.open("rb") as stream:
                digest.update(file_digest(stream, "sha256").digest())
        return digest.hexdigest()

    @contextmanager
    def opened(self) -> Iterator[Any]:
        """Open it with rosbags; raises BenchbotError when it cannot be read to its end."""
        from sqlite3 import Error

        from mcap.exceptions import McapError
        from rosbags.rosbag2 import Reader, ReaderError
        from rosbags.serde import SerdeError

        try:
            with Reader(self.path) as reader:
                yield reader
        except (ReaderError, SerdeError, McapError, Error, OSError, ValueError, AssertionError) as error:
            raise self.refused(f"It cannot be read: {error}.") from error
