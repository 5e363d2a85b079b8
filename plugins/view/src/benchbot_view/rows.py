"""One line of the table: what it tells of a result, and the files that may be results."""

import os
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from hashlib import sha256
from pathlib import PurePath
from typing import Any

import msgspec

from benchbot.viewing import one_line

PLAN = "plan.json"
LARGEST_BYTES = 64 * 2**20
LONGEST = 200


class _Named(msgspec.Struct):
    name: str = ""
    variant: int | str = ""


class _Selection(msgspec.Struct):
    robot: str | None = None
    seed: int | None = None
    repeat: int | None = None
    episode: dict[str, Any] | None = None


class _Solution(msgspec.Struct):
    command: list[str] | None = None
    example: str | None = None


class _Provenance(msgspec.Struct):
    selection: _Selection | None = None
    solution: _Solution | None = None
    steps: int | None = None
    failure: dict[str, Any] | None = None


class _Result(msgspec.Struct):
    """The part of a result that a row tells."""

    task_details: _Named
    environment_details: list[_Named]
    results: msgspec.Raw = msgspec.Raw()
    provenance: _Provenance | None = None


class Row(msgspec.Struct, array_like=True):
    """One episode; in JSON an array, in this order (`static/rows.js` names the columns)."""

    id: str
    set: str
    solution: str
    task: str
    environment: str
    robot: str
    seed: int | None = None
    repeat: int | None = None
    episode: int | None = None
    state: str = "pending"
    why: str = ""
    score_name: str = ""
    score: float | None = None
    steps: int | None = None
    changed_s: float = 0.0
    revision: int = 0


_DECODER = msgspec.json.Decoder(_Result)

# Of ten thousand files, each pathlib.Path would cost as much as reading what it names: paths are text here.


def id_of(path: str | os.PathLike[str]) -> str:
    """Return what a result is called in addresses: it says nothing of where it lies."""
    return sha256(os.path.abspath(path).encode("utf-8", "surrogateescape")).hexdigest()[:12]  # noqa: PTH100


def json_files(folder: str) -> Iterator[os.DirEntry[str]]:
    """Yield the JSON files in a folder, sorted, hidden ones and those of recordings left out; of a batch the plan."""
    try:
        with os.scandir(folder) as found:
            entries = sorted(found, key=lambda entry: entry.name)
    except OSError:
        return
    plan = next((entry for entry in entries if entry.name == PLAN), None)
    if plan is not None:
        yield plan
        return
    for entry in entries:
        if entry.name.startswith("."):
            continue
        if entry.is_dir(follow_symlinks=False):
            if not entry.name.endswith(("-recordings", ".frames")):
                yield from json_files(entry.path)
        elif entry.name.endswith(".json") and entry.is_file():
            yield entry


def read_result(path: str, about: os.stat_result) -> Row | None:
    """Return what a row tells of a result, without id and set; None for a file that is none."""
    if about.st_size > LARGEST_BYTES:
        return None
    try:
        with open(path, "rb", buffering=0) as file:  # noqa: PTH123
            found = _DECODER.decode(file.read())
    except (OSError, msgspec.DecodeError, RecursionError):
        return None
    if not found.environment_details or not found.task_details.name:
        return None
    provenance = found.provenance or _Provenance()
    selection, solution = provenance.selection or _Selection(), provenance.solution or _Solution()
    failure: Mapping[str, Any] = provenance.failure or {}
    scenes = found.environment_details
    episode = (selection.episode or {}).get("number")
    missing = not bytes(found.results)
    return Row(
        id="",
        set="",
        solution=shown(solution.example or _command(solution.command) or os.path.basename(os.path.dirname(path))),  # noqa: PTH119, PTH120
        task=shown(found.task_details.name),
        environment=shown(":".join([scenes[0].name, *(str(scene.variant) for scene in scenes)])),
        robot=shown(selection.robot or ""),
        seed=selection.seed,
        repeat=selection.repeat,
        episode=episode if isinstance(episode, int) else None,
        state=shown(str(failure.get("class") or ("no results" if missing else "done"))),
        why=shown(str(failure.get("why") or "")),
        steps=provenance.steps,
    )


def _command(words: Sequence[str] | None) -> str:
    """Return what a command runs: its script, else its program."""
    named = [PurePath(word).stem for word in words or () if word.endswith(".py")]
    return named[0] if named else PurePath(words[0]).name if words else ""


@lru_cache(maxsize=4096)
def shown(text: str) -> str:
    """Return a foreign text as a cell shows it: on one line, and not too long."""
    line = one_line(text)
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 1]}…"
