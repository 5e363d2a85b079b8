"""Wheels and sdists of all distributions, and the proof that an sdist makes the same wheel."""

import tarfile
import tempfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from email import message_from_string
from email.message import Message
from pathlib import Path

from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

from release.projects import Project


@dataclass(frozen=True)
class Built:
    """What was made of a project."""

    project: Project
    wheel: Path
    sdist: Path

    @property
    def version(self) -> str:
        """The version that its file names tell."""
        return self.wheel.name.split("-")[1]

    def files(self) -> dict[str, bytes]:
        """Return the files in the wheel."""
        return files_of(self.wheel)

    def metadata(self) -> Message:
        """Return the wheel's METADATA."""
        return message_from_string(self.of_info("METADATA").decode())

    def of_info(self, name: str) -> bytes:
        """Return a file of the wheel's .dist-info folder; empty if there is none."""
        found = [data for path, data in self.files().items() if path.endswith(f".dist-info/{name}")]
        return found[0] if found else b""


def build(project: Project, folder: Path) -> Built:
    """Build a project's wheel and sdist into a folder. Nothing is written to the checkout."""
    return Built(project, _wheel(project.folder, folder), _sdist(project.folder, folder))


def files_of(wheel: Path) -> dict[str, bytes]:
    """Return the names and bytes of a wheel's files."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def differences_by_sdist(built: Built) -> Iterator[str]:
    """Yield the names of files that the wheel made of the sdist has otherwise than the one made of the checkout."""
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(built.sdist) as archive:
            archive.extractall(folder, filter="data")
        (unpacked,) = Path(folder).iterdir()
        again = files_of(_wheel(unpacked, Path(folder)))
    direct = built.files()
    yield from sorted(name for name in direct.keys() | again.keys() if direct.get(name) != again.get(name))


def _wheel(root: Path, folder: Path) -> Path:
    return Path(next(iter(WheelBuilder(str(root)).build(directory=str(folder), versions=["standard"]))))


def _sdist(root: Path, folder: Path) -> Path:
    return Path(next(iter(SdistBuilder(str(root)).build(directory=str(folder), versions=["standard"]))))
