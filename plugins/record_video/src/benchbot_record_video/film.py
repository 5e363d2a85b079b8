"""The base of both recorders: a frame for each observation, and the error for one that cannot be written."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from benchbot.plugin import BenchbotError, ExitCode, FailureClass, Progress, Step

FRAMES_PER_S = 5
"""An observation takes as long as any other: a turn on the spot and a long drive are one step of the solution each."""


class Film(Protocol):
    """A film that is being written. Methods raise OSError when the disk refuses."""

    def add(self, image: NDArray[np.uint8]) -> None:
        """Append a frame, (H, W, 3), sRGB, of the same size as the ones before."""

    def close(self) -> None:
        """Finish it."""


class FilmRecording:
    """Writes what `image_rgb` shows into one file, which is there from the first frame on; a reset replaces it."""

    def __init__(self, folder: Path, name: str, begin: Callable[[Path], Film]) -> None:
        self._path = folder / name
        self._begin = begin
        self._film: Film | None = None
        self._size: tuple[int, ...] = ()
        with self.told():
            folder.mkdir(parents=True, exist_ok=True)

    def reset(self) -> None:
        """Start the film over."""
        with self.told():
            self.close()
            self._path.unlink(missing_ok=True)

    def step(self, action: str | None, arguments: Mapping[str, float], step: Step, progress: Progress) -> None:
        """Add a frame, if the task observes one."""
        image = step.observations.get("image_rgb")
        if image is None:
            return
        with self.told():
            if self._film is None:
                self._film, self._size = self._begin(self._path), image.shape
            if image.shape != self._size:
                raise OSError(f"The camera's picture was {self._size}, and is {image.shape} now")
            self._film.add(image)

    def close(self) -> None:
        """Finish the film, if it has begun. Safe to call twice."""
        film, self._film = self._film, None
        if film is not None:
            with self.told():
                film.close()

    @contextmanager
    def told(self) -> Iterator[None]:
        """Raise BenchbotError for an OSError within."""
        try:
            yield
        except OSError as error:
            raise BenchbotError(
                f"The film {self._path} cannot be written.",
                f"{error.strerror or error}.",
                "Make room, or record into a folder on a disk that has some and that you may write to.",
                exit_code=ExitCode.INTERNAL,
                failure=FailureClass.INFRASTRUCTURE,
            ) from error
