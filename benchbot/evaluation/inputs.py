"""Results as people hand them in: JSON files, and ZIP archives of them. Nothing is ever extracted to disk."""

import json
import lzma
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from benchbot.core import results, schema
from benchbot.core.errors import BenchbotError, FailureClass

SIZE_LIMIT_BYTES = 64 * 2**20
MEMBER_LIMIT = 10_000
RATIO_LIMIT = 500
"""How much larger than its compressed form a member may be; JSON seldom reaches 100."""

_IGNORED = "submission.json"


@dataclass(frozen=True)
class Submission:
    """One result document and where it came from: a path, or `archive:member`."""

    source: str
    document: dict[str, Any]

    @property
    def task(self) -> str:
        """The task's name."""
        return str(self.document["task_details"]["name"])

    @property
    def results_format(self) -> str | None:
        """The name of the format of its results, if the task has one."""
        name: str | None = self.document["task_details"].get("results_format")
        return name

    @property
    def environment(self) -> str:
        """The environment string: `name:variant[:variant…]`."""
        scenes = self.document["environment_details"]
        return ":".join([str(scenes[0]["name"]), *(str(scene["variant"]) for scene in scenes)])

    @property
    def failure(self) -> FailureClass | None:
        """Whose fault it is that the episode did not end well, if it did not."""
        failure = self._failure()
        return None if failure is None else FailureClass(failure["class"])

    @property
    def failure_why(self) -> str:
        """What went wrong, if something did."""
        return str((self._failure() or {}).get("why", ""))

    def _failure(self) -> dict[str, Any] | None:
        return (self.document.get("provenance") or {}).get("failure")


@dataclass(frozen=True)
class Unreadable:
    """A file or member that holds no result, and why."""

    source: str
    error: BenchbotError


def read(paths: Iterable[Path]) -> Iterator[Submission | Unreadable]:
    """Yield the results in files and archives, in order; what cannot be read comes with its error."""
    for path in paths:
        try:
            if zipfile.is_zipfile(path):
                yield from _members(path)
            else:
                yield _submission(str(path), _file(path))
        except BenchbotError as error:
            yield Unreadable(str(path), error)


def _members(path: Path) -> Iterator[Submission | Unreadable]:
    """Yield the JSON members of an archive except `submission.json`, sorted by name."""
    found = False
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if len(members) > MEMBER_LIMIT:
                raise _refused(str(path), f"It has {len(members)} members; at most {MEMBER_LIMIT} are read.")
            for member in sorted(members, key=lambda info: info.filename):
                name = PurePosixPath(member.filename)
                if name.suffix.lower() != ".json" or name.name == _IGNORED or "__MACOSX" in name.parts:
                    continue
                found = True
                source = f"{path}:{member.filename}"
                try:
                    yield _submission(source, _member(archive, member, source))
                except BenchbotError as error:
                    yield Unreadable(source, error)
    except (zipfile.BadZipFile, OSError) as error:
        raise _refused(str(path), f"It is not a readable ZIP archive: {error}.") from error
    if not found:
        raise _refused(str(path), "The archive holds no JSON file.")


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, source: str) -> bytes:
    if member.file_size > SIZE_LIMIT_BYTES:
        raise _refused(source, f"It is larger than {SIZE_LIMIT_BYTES >> 20} MiB.")
    if member.file_size > RATIO_LIMIT * max(member.compress_size, 1024):
        raise _refused(source, f"It is compressed more than {RATIO_LIMIT}-fold, as no result is.")
    try:
        # zipfile never yields more than file_size bytes, whatever the compressed stream holds.
        return archive.read(member)
    except (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, OSError) as error:
        raise _refused(source, f"It is damaged: {error}.") from error
    except (RuntimeError, NotImplementedError) as error:
        raise _refused(source, f"It is encrypted or in an unknown compression: {error}.") from error


def _file(path: Path) -> bytes:
    if not path.is_file():
        raise _refused(str(path), "There is no such file.")
    try:
        if path.stat().st_size > SIZE_LIMIT_BYTES:
            raise _refused(str(path), f"It is larger than {SIZE_LIMIT_BYTES >> 20} MiB.")
        return path.read_bytes()
    except OSError as error:
        raise _refused(str(path), f"{error.strerror}.") from error


def _submission(source: str, content: bytes) -> Submission:
    try:
        document = json.loads(content)
    except RecursionError as error:
        raise _refused(source, "It is nested too deeply.") from error
    except ValueError as error:  # broken JSON, text that is not Unicode, absurdly long numbers
        raise _refused(source, f"It is not valid JSON: {error}.") from error
    if not isinstance(document, dict):
        raise _refused(source, f"It holds a {type(document).__name__} where a result's mapping should be.")
    version = document.get("version", results.VERSION)
    if version != results.VERSION:
        raise _refused(
            source,
            f"It is a result of version {version!r:.20}; this BenchBot reads version {results.VERSION} "
            "and results of BenchBot v2.",
        )
    schema.check(document, "result", Path(source))
    return Submission(source, document)


def _refused(source: str, why: str) -> BenchbotError:
    return BenchbotError(
        f"{source} is not a result.",
        why,
        "Give JSON files that a solution saved, or ZIP archives of them.",
    )
