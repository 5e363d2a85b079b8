"""Reading result documents from JSON files, ZIP archives and folders of them. Nothing is ever extracted to disk."""

import lzma
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from benchbot.core.errors import BenchbotError
from benchbot.evaluation.result_document import DerivedDocumentError, ResultDocument, not_a_result, parse

SIZE_LIMIT_BYTES = 64 * 2**20
ARCHIVE_LIMIT_BYTES = 512 * 2**20
"""Limit of all members of an archive together: members may overlap, so that each one looks harmless."""
FILE_LIMIT = 10_000
RATIO_LIMIT = 500
"""Limit of a member's size over its compressed size; JSON seldom reaches 100."""

_IGNORED = ("scores.json", "submission.json")
_RESULTS = ("results",)
_OF_A_BUNDLE = {("manifest.json",), ("solution",), _RESULTS}
"""The top-level names by which a bundle (docs/bundles.md) is told from other archives; its results are in `results`."""


@dataclass(frozen=True)
class Unreadable:
    """A file or member that holds no result, and why."""

    source: str
    error: BenchbotError


@dataclass(frozen=True)
class DerivedFile:
    """A document that was computed from results and lies among them, such as their scores, and why it is no result."""

    source: str
    why: str


Item = ResultDocument | Unreadable | DerivedFile


def read(paths: Iterable[Path]) -> Iterator[Item]:
    """Yield the results in files, archives and folders; what cannot be read comes with its error.

    Folders are searched through for `*.json` and `*.zip`, sorted by path, hidden ones left out. In folders and archives
    `scores.json` and `submission.json` are passed over, and what else was computed from results comes as `DerivedFile`.
    """
    for path in paths:
        try:
            if path.is_dir():
                for file in _files(path):
                    yield from _among_others(_contents(file))
            else:
                yield from _contents(path)
        except BenchbotError as error:
            yield Unreadable(str(path), error)


def _contents(path: Path) -> Iterator[Item]:
    """Yield the result in a file, or those in an archive."""
    try:
        if zipfile.is_zipfile(path):
            yield from _among_others(_members(path))
        else:
            yield parse(str(path), _file(path))
    except BenchbotError as error:
        yield Unreadable(str(path), error)


def _among_others(items: Iterable[Item]) -> Iterator[Item]:
    """Yield the items; a document computed from results is no error where it lies beside them without being named."""
    for item in items:
        if isinstance(item, Unreadable) and isinstance(item.error, DerivedDocumentError):
            yield DerivedFile(item.source, item.error.why)
        else:
            yield item


def _files(folder: Path) -> list[Path]:
    """Return the JSON files and archives in a folder and those below it, sorted."""
    found = []
    for path in folder.rglob("*"):
        parts = path.relative_to(folder).parts
        if path.suffix.lower() not in (".json", ".zip") or path.name in _IGNORED or not path.is_file():
            continue
        if not any(part.startswith(".") for part in parts):
            found.append(path)
    if not found:
        raise not_a_result(str(folder), "The folder holds no JSON file and no ZIP archive.")
    if len(found) > FILE_LIMIT:
        raise not_a_result(str(folder), f"It holds {len(found)} files; at most {FILE_LIMIT} are read.")
    return sorted(found)


def _members(path: Path) -> Iterator[ResultDocument | Unreadable]:
    """Yield the JSON members of an archive, sorted by name."""
    found = False
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            if len(members) > FILE_LIMIT:
                raise not_a_result(str(path), f"It has {len(members)} members; at most {FILE_LIMIT} are read.")
            if sum(member.file_size for member in members) > ARCHIVE_LIMIT_BYTES:
                raise not_a_result(str(path), f"Its members are larger than {ARCHIVE_LIMIT_BYTES >> 20} MiB together.")
            tops = {PurePosixPath(member.filename).parts[:1] for member in members}
            bundled = tops >= _OF_A_BUNDLE
            for member in sorted(members, key=lambda info: info.filename):
                name = PurePosixPath(member.filename)
                if bundled and name.parts[:1] != _RESULTS:
                    continue  # the solution's own files
                if name.suffix.lower() != ".json" or name.name in _IGNORED or "__MACOSX" in name.parts:
                    continue
                found = True
                source = f"{path}:{member.filename}"
                try:
                    yield parse(source, _member(archive, member, source))
                except BenchbotError as error:
                    yield Unreadable(source, error)
    except (zipfile.BadZipFile, OSError) as error:
        raise not_a_result(str(path), f"It is not a readable ZIP archive: {error}.") from error
    if not found:
        raise not_a_result(str(path), "The archive holds no JSON file.")


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, source: str) -> bytes:
    if member.filename.startswith("/") or ".." in PurePosixPath(member.filename).parts:
        raise not_a_result(source, "Its name leads out of the archive, as no result's does.")
    if member.file_size > SIZE_LIMIT_BYTES:
        raise not_a_result(source, f"It is larger than {SIZE_LIMIT_BYTES >> 20} MiB.")
    if member.file_size > RATIO_LIMIT * max(member.compress_size, 1024):
        raise not_a_result(source, f"It is compressed more than {RATIO_LIMIT}-fold, as no result is.")
    try:
        # zipfile never yields more than file_size bytes, whatever the compressed stream holds.
        return archive.read(member)
    except (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, OSError) as error:
        raise not_a_result(source, f"It is damaged: {error}.") from error
    except (RuntimeError, NotImplementedError) as error:
        raise not_a_result(source, f"It is encrypted or in an unknown compression: {error}.") from error


def _file(path: Path) -> bytes:
    if not path.is_file():
        raise not_a_result(str(path), "There is no such file.")
    try:
        if path.stat().st_size > SIZE_LIMIT_BYTES:
            raise not_a_result(str(path), f"It is larger than {SIZE_LIMIT_BYTES >> 20} MiB.")
        return path.read_bytes()
    except OSError as error:
        raise not_a_result(str(path), f"{error.strerror}.") from error
