"""From what an environment's `map_path` names to a scene file: as it is, composed, or converted, and then kept."""

import hashlib
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.plugin import BenchbotError, write_atomically
from benchbot_scenes.differences import LAYOUT_SUFFIXES
from benchbot_scenes.layout import read_layout

if TYPE_CHECKING:
    from benchbot_scenes.compose import Recipe

VERSION = 3
"""Counts up when the same layout would be composed into other bytes."""

_SEAL = b"SEAL"


def scene_file(path: Path, cache_dir: Path, assets: str | None = None) -> Path:
    """The GLB file of a scene: `path` itself when it is one, else what a layout (.yaml) or another file is made into.

    What is made is kept in `cache_dir` under a name that says all that it was made of; a damaged file there is made
    again. `assets` names a pack whose models stand in for the objects of a layout. Raises BenchbotError.
    """
    if path.suffix.lower() in LAYOUT_SUFFIXES:
        from benchbot_scenes.compose import cook, recipe

        made_of = recipe(read_layout(path), assets=assets)
        if assets is not None and made_of.furnished.finished is not None:
            raise BenchbotError(
                f"The objects of the layout {path} cannot be taken from another asset pack.",
                f"Its base is a finished scene: {made_of.furnished.finished}.",
                "Leave 'assets' out, or choose an environment whose layout has no finished base.",
            )
        return _kept(cache_dir, _fingerprint(made_of), lambda: cook(made_of))
    if path.suffix.lower() != ".glb":
        from benchbot_scenes.importing import understanding

        return _kept(cache_dir, understanding.digest(path), lambda: understanding.convert(path))
    return path


def _fingerprint(made_of: "Recipe") -> str:
    """The SHA-256, in hex, of all that a composed scene depends on."""
    scene = made_of.furnished
    building = None if made_of.plan is None else repr(scene.building)
    placed = [(p.name, p.model.file.name, p.matrix.tolist(), p.class_name, p.is_group) for p in made_of.objects]
    fitted = [(f.name, f.model.file.name, f.matrix.tolist(), f.open_deg) for f in made_of.fittings]
    finished = [(p.name, repr(p.model.finish)) for p in made_of.objects if p.model.finish]
    digests = [hashlib.sha256(path.read_bytes()).hexdigest() for path in made_of.files()]
    facts = [VERSION, building, sorted(scene.removed), repr(scene.moved), placed, fitted, finished, digests]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def _kept(cache_dir: Path, key: str, make: Callable[[], bytes]) -> Path:
    """The file of this key in the cache, made when it is not there or damaged; readers see all of it or none."""
    path = cache_dir / "scenes" / f"{key}.glb"
    try:
        if not _is_whole(path):
            write_atomically(path, _sealed(make()))
    except OSError as error:
        raise BenchbotError(
            f"A composed scene cannot be kept in {path.parent}.",
            str(error),
            "Make the folder writable, or name another in the environment variable BENCHBOT_CACHE_DIR.",
        ) from error
    return path


def _sealed(data: bytes) -> bytes:
    """A GLB file with the SHA-256 of all before as a last chunk; readers skip chunks that they do not know."""
    magic, version, length = struct.unpack_from("<4sII", data)
    whole = struct.pack("<4sII", magic, version, length + 40) + data[12:]
    return whole + struct.pack("<I4s", 32, _SEAL) + hashlib.sha256(whole).digest()


def _is_whole(path: Path) -> bool:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return False
    return data[-36:-32] == _SEAL and hashlib.sha256(data[:-40]).digest() == data[-32:]
