"""Reading result documents from JSON files, ZIP archives and folders of them. Nothing is ever extracted to disk."""

import lzma
import os
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from benchbot.core.errors import BenchbotError
from benchbot.core.long_work import counted
from benchbot.evaluation import batch_folder
from benchbot.evaluation.batch_folder import PlannedResult
from benchbot.evaluation.result_document import OtherDocumentError, ResultDocument, not_a_result, parse

_NAMED_BY_FOLDER = ("result.json", "scores.json")
SIZE_LIMIT_BYTES = 64 * 2**20
ARCHIVE_LIMIT_BYTES = 512 * 2**20
"""Limit of all members of an archive together: members may overlap, so that each one looks harmless."""
FILE_LIMIT = 10_000
RATIO_LIMIT = 500
"""Limit of a member's size over its compressed size; JSON seldom reaches 100."""

_RESULTS = ("results",)
_OF_A_BUNDLE = {("manifest.json",), ("solution",), _RESULTS}
"""The top-level names by which a bundle (docs/bundles.md) is told from other archives; its results are in `results`."""


@dataclass(frozen=True)
class Unreadable:
    """A file or member that should hold a result and does not, and why."""

    source: str
    error: BenchbotError


@dataclass(frozen=True)
class OtherFile:
    """A file among results that is none, and why; `is_own` says that it is one of BenchBot's own."""

    source: str
    why: str
    is_own: bool = False


Item = ResultDocument | Unreadable | OtherFile | PlannedResult


def read(paths: Iterable[Path]) -> Iterator[Item]:
    """Yield the results in files, archives and folders; what cannot be read comes with its error.

    Folders are searched through for `*.json` and `*.zip`, sorted by path, hidden ones left out. There and in archives,
    what is not shaped like a result comes as `OtherFile`; a file that is named is a result, broken or not. The folder
    of a batch is read by its plan; an episode without a result comes as it is planned.
    """
    for path in counted("Reading results", list(paths)):
        try:
            if path.is_dir():
                for found in counted(f"Reading results in {path}", _files(path)):
                    yield from _batch(found) if found.is_dir() else _among_others(_contents(found))
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
    """Yield the items; what is not shaped like a result is no broken one where it lies among them unnamed."""
    for item in items:
        if isinstance(item, Unreadable) and isinstance(item.error, OtherDocumentError):
            yield OtherFile(item.source, item.error.why, item.error.is_own)
        else:
            yield item


def _batch(folder: Path) -> Iterator[Item]:
    """Yield the results of a batch by its plan, and what else lies beside the plan."""
    episodes = batch_folder.planned(folder) or []
    if len(solutions := dict.fromkeys(episode.solution for episode in episodes)) > 1:
        raise not_a_result(
            str(folder),
            "It is a batch of several solutions, whose results have no score together.",
            f"Name those of one: {folder / batch_folder.RESULTS / str(next(iter(solutions)))}",
        )
    for episode in counted(f"Reading results in {folder}", episodes):
        if episode.path.is_file():
            yield from _contents(episode.path)
        else:
            yield episode
    for path in batch_folder.of_no_plan(folder, episodes):
        yield OtherFile(str(path), "The plan of its batch has this episode no more.")
    for item in _among_others(item for path in sorted(folder.glob("*.json")) for item in _contents(path)):
        yield OtherFile(item.source, item.why, is_own=True) if isinstance(item, OtherFile) else item


def _files(folder: Path) -> list[Path]:
    """Return the JSON files, archives and folders of batches in a folder and those below it, sorted."""
    found = []
    for place, folders, names in os.walk(folder):
        here = Path(place)
        is_batch = batch_folder.planned(here) is not None
        if is_batch or batch_folder.SNAPSHOT in names:
            found += [here] if is_batch else []
            folders.clear()
            continue
        hidden = "." if batch_folder.JOURNAL not in names else (".", batch_folder.ATTEMPT, batch_folder.WORK)
        folders[:] = [name for name in folders if not name.startswith(hidden)]
        files = (here / name for name in names if not name.startswith("."))
        found += [path for path in files if path.suffix.lower() in (".json", ".zip") and path.is_file()]
    if not found:
        raise not_a_result(str(folder), "The folder holds no JSON file and no ZIP archive.")
    if len(found) > FILE_LIMIT:
        raise not_a_result(str(folder), f"It holds {len(found)} files; at most {FILE_LIMIT} are read.")
    return sorted(found)


def _members(path: Path) -> Iterator[ResultDocument | Unreadable]:
    """Yield the JSON members of an archive, sorted by name; those of a bundle's solution are left out."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = {member: PurePosixPath(member.filename) for member in archive.infolist()}
            bundled = {name.parts[:1] for name in names.values()} >= _OF_A_BUNDLE
            members = [
                member
                for member, name in names.items()
                if name.suffix.lower() == ".json"
                and "__MACOSX" not in name.parts
                and (not bundled or name.parts[:1] == _RESULTS)
            ]
            if len(members) > FILE_LIMIT:
                raise not_a_result(str(path), f"It has {len(members)} members; at most {FILE_LIMIT} are read.")
            if sum(member.file_size for member in members) > ARCHIVE_LIMIT_BYTES:
                raise not_a_result(str(path), f"Its members are larger than {ARCHIVE_LIMIT_BYTES >> 20} MiB together.")
            for member in sorted(members, key=lambda info: info.filename):
                source = f"{path}:{member.filename}"
                try:
                    yield parse(source, _member(archive, member, source))
                except BenchbotError as error:
                    yield Unreadable(source, error)
    except (zipfile.BadZipFile, OSError) as error:
        raise not_a_result(str(path), f"It is not a readable ZIP archive: {error}.") from error
    if not members:
        raise OtherDocumentError(str(path), "The archive holds no JSON file.")


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


def named(text: str) -> tuple[str, Path]:
    """Return the name and the path of a set, from `PATH` or `NAME=PATH`."""
    name, separator, path = text.partition("=")
    if separator and name and "/" not in name and not Path(text).exists():
        return name, Path(path)
    found = Path(text)
    if found.is_dir():
        return found.resolve().name, found
    return (found.resolve().parent.name if found.name in _NAMED_BY_FOLDER else found.stem), found
