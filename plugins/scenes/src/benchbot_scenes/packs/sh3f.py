"""Libraries of furniture for Sweet Home 3D: ZIP archives (.sh3f) with a catalogue and OBJ models.

The catalogue's keys are explained in sweethome3d.com/javadoc (DefaultFurnitureCatalog); models are y up and face +z.
"""

import re
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError

CATALOGUE = "PluginFurnitureCatalog.properties"
MEMBER_LIMIT_BYTES = 128 * 2**20
RATIO_LIMIT = 500
CLEAR_BELOW = 0.75
"""Limit of a file's size over its compressed size."""

_NEEDED = (".obj", ".mtl", ".png", ".jpg", ".jpeg", ".bmp", ".gif")
_ENTRY = re.compile(r"^(\w+)#(\d+)=(.*)$", re.MULTILINE)
_HEAD = re.compile(r"^(\w+)=(.*)$", re.MULTILINE)
_ESCAPE = re.compile(r"\\u([0-9a-fA-F]{4})")
_BROKEN = (zipfile.BadZipFile, zlib.error, EOFError, OSError, KeyError, ValueError, NotImplementedError, RuntimeError)


@dataclass(frozen=True)
class Furniture:
    """A model of a library: `size_m` is its width, height and depth (x, y, z of the OBJ file) after `rotation` (3, 3).

    `elevation_m` says how high it hangs; `top_m` where things stand on it, None where the catalogue says nothing.
    """

    library: str
    id: str
    name: str
    member: str
    size_m: tuple[float, float, float]
    elevation_m: float
    top_m: float | None
    rotation: npt.NDArray[np.float64]
    creator: str


class Library:
    """An open library; use it in a `with` statement. Raises BenchbotError when it is damaged."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._archive = zipfile.ZipFile(path)
            text = self._archive.read(self._checked(CATALOGUE)).decode("latin-1")
        except _BROKEN as error:
            raise self._broken(error) from error
        text = text.replace("\r", "")
        head = dict(_HEAD.findall(text))
        self.licence = _unescaped(head.get("license", "unknown licence"))
        self._entries: dict[str, dict[str, str]] = {}
        for key, number, value in _ENTRY.findall(text):
            self._entries.setdefault(number, {})[key] = _unescaped(value.strip())

    def __enter__(self) -> "Library":
        return self

    def __exit__(self, *_: object) -> None:
        self._archive.close()

    def furniture(self) -> Iterator[Furniture]:
        """Yield what the catalogue lists."""
        for entry in self._entries.values():
            try:
                yield _furniture(entry)
            except (KeyError, ValueError) as error:
                raise self._broken(error) from error

    def extract(self, furniture: Furniture, folder: Path) -> Path:
        """Write a model and what lies beside it into an empty folder; returns the OBJ file."""
        beside = str(PurePosixPath(furniture.member).parent) + "/"
        try:
            for name in self._archive.namelist():
                if name.startswith(beside) and name.lower().endswith(_NEEDED):
                    member = self._checked(name)
                    target = folder / PurePosixPath(name).relative_to(beside)
                    target.parent.mkdir(parents=True, exist_ok=True)
                    target.write_bytes(self._archive.read(member))
            for library in folder.rglob("*.mtl"):
                library.write_text(_usable(library), "utf-8")
        except _BROKEN as error:
            raise self._broken(error) from error
        return folder / PurePosixPath(furniture.member).name

    def _checked(self, name: str) -> zipfile.ZipInfo:
        member = self._archive.getinfo(name)
        if name.startswith("/") or ".." in PurePosixPath(name).parts or "\\" in name:
            raise ValueError(f"the name {name} leads out of the archive")
        if member.file_size > MEMBER_LIMIT_BYTES or member.file_size > RATIO_LIMIT * max(member.compress_size, 1024):
            raise ValueError(f"{name} would unpack to {member.file_size >> 20} MiB")
        return member

    def _broken(self, error: Exception) -> BenchbotError:
        why = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        return BenchbotError(
            f"{self._path.name} is not a library of Sweet Home 3D that can be read.",
            f"{why}.",
            "Fetch it again; it may be cut short.",
        )


def _furniture(entry: dict[str, str]) -> Furniture:
    top = float(entry.get("dropOnTopElevation", "nan"))
    rotation = np.array(entry.get("modelRotation", "1 0 0 0 1 0 0 0 1").split(), np.float64).reshape(3, 3)
    width, depth, height = (float(entry[key]) / 100 for key in ("width", "depth", "height"))
    if not all(0 < size < 100 for size in (width, depth, height)) or not np.isfinite(rotation).all():
        raise ValueError(f"{entry['id']} has no usable size")
    return Furniture(
        library=entry["id"].partition("#")[0],
        id=entry["id"].partition("#")[2],
        name=entry.get("name", entry["id"]),
        member=entry["model"].lstrip("/"),
        size_m=(width, height, depth),
        elevation_m=float(entry.get("elevation", "0")) / 100,
        top_m=top / 100 if top > 0 else None,
        rotation=rotation,
        creator=entry.get("creator", "unknown"),
    )


def _usable(library: Path) -> str:
    """Return the text of a material library that names textures as they lie beside it, and none that do not.

    Some name files on the machine of who made them: where a single picture lies beside the model, that is meant. What
    is somewhat transparent is as good as clear: Sweet Home 3D blends, rays go through or not.
    """
    pictures = [path for path in library.parent.iterdir() if path.suffix.lower() in _NEEDED[2:]]
    only_picture = pictures[0].name if len(pictures) == 1 else ""
    lines = []
    for line in library.read_text("latin-1").splitlines():
        keyword, _, rest = line.strip().partition(" ")
        if keyword == "d" and rest and float(rest.split()[-1]) < CLEAR_BELOW:
            lines.append("d 0")
            continue
        if not keyword.lower().startswith(("map_", "bump", "norm")):
            lines.append(line)
            continue
        written = rest.replace("\\", "/").strip().lstrip("/")
        for name in (written, written.rpartition("/")[2], only_picture):
            if (library.parent / name).is_file():
                lines.append(f"{keyword} {name}")
                break
    return "\n".join(lines) + "\n"


def _unescaped(text: str) -> str:
    return _ESCAPE.sub(lambda match: chr(int(match[1], 16)), text)
