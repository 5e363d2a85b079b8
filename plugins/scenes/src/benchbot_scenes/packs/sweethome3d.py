"""The pack `sweethome3d`: furniture of Debian's package sweethome3d-furniture (CC0 and CC BY 3.0), made into assets.

`sweethome3d.yaml` says which of its models become assets, and what each is.
"""

import hashlib
import json
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.packs import debian, folder
from benchbot_scenes.packs.fitting import fitted
from benchbot_scenes.packs.sh3f import Furniture, Library
from benchbot_scenes.scene import Instance

NAME = "sweethome3d"
PACKAGE = "sweethome3d-furniture"
INSTALLED = Path("/usr/share/sweethome3d")
MAX_TRIANGLES = 32_000

_STANDS_ON_THE_FLOOR = {
    *("armchair", "basket", "bed", "bedside table", "bidet", "bookcase", "chair", "chest of drawers", "coffee table"),
    *("couch", "desk", "kitchen counter", "office cabinet", "oven", "person", "radiator", "refrigerator", "rug"),
    *("sideboard", "sink", "table", "toilet", "wardrobe"),
}
_HANGS_FROM_M = 0.3
_TALL_PLANT_M = 0.45
_RIM = 0.1
"""The margin of a top, on each side, that stays empty."""

_HEADROOM_M = 0.6

Entry = dict[str, Any]
Progress = Callable[[Sequence["Wanted"]], Iterable["Wanted"]]


@dataclass(frozen=True)
class Wanted:
    """A model that becomes an asset: its library, and its entries in the library and in the table."""

    library: Library
    furniture: Furniture
    said: Mapping[str, Any] = field(hash=False)

    @property
    def id(self) -> str:
        """The asset's id, such as `scopia_apples_apple_1`."""
        words = f"{self.furniture.library} {self.furniture.id} {self.said.get('suffix', '')}"
        spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", words)
        return re.sub(r"[^a-z0-9]+", "_", spaced.lower()).strip("_")


@dataclass(frozen=True)
class Installed:
    """The result of an installation: its models, and those left out, with the reasons."""

    path: Path
    models: int
    left_out: tuple[str, ...]


def install(source: Path | None, progress: Progress) -> Installed:
    """Make the pack from a .deb, a .sh3f, a folder of such, or (None) what is installed here or apt can fetch.

    `progress` is given the models and yields them again, one by one. Raises BenchbotError when nothing can be made.
    """
    with folder.new(NAME) as made, tempfile.TemporaryDirectory(prefix="benchbot-") as scratch:
        paths = _libraries(source, Path(scratch))
        models, left_out = _convert(paths, made, progress)
        if not models:
            raise BenchbotError(
                "None of the models could be made into an asset.",
                "\n".join(left_out) or f"The libraries have none of those that are known: {_listed(paths)}.",
                f"Give the libraries of Debian's {PACKAGE}: --from FILE.deb",
            )
        document = {"name": NAME, "version": 1, "models": models}
        (made / folder.CATALOGUE).write_text(json.dumps(document, indent=1, sort_keys=True) + "\n", "utf-8")
        (made / "CREDITS.txt").write_text(_credits(models), "utf-8")
    return Installed(folder.installed()[NAME].parent, len(models), tuple(left_out))


def _libraries(source: Path | None, scratch: Path) -> list[Path]:
    if source is None:
        source = INSTALLED if any(INSTALLED.rglob("*.sh3f")) else debian.download(PACKAGE, scratch)
    if source.is_dir():
        found = sorted(source.rglob("*.sh3f"))
    elif source.suffix == ".deb":
        found = debian.unpack(source, scratch, (".sh3f",))
    else:
        found = [source] if source.suffix == ".sh3f" and source.is_file() else []
    if not found:
        raise BenchbotError(
            f"There are no models for the pack '{NAME}' in {source}.",
            "It is no .deb, no .sh3f and no folder that holds a .sh3f.",
            f"Name Debian's package: --from {PACKAGE}_VERSION_all.deb, or leave --from out to fetch it.",
        )
    return sorted(found)


def _convert(paths: Iterable[Path], made: Path, progress: Progress) -> tuple[list[Entry], list[str]]:
    table = _table()
    models: list[Entry] = []
    left_out: list[str] = []
    (made / "models").mkdir()
    libraries = [Library(path) for path in paths]
    try:
        wanted = [each for library in libraries for each in _wanted(library, table)]
        for each in progress(wanted):
            try:
                models.append(_asset(each, made / "models"))
            except (BenchbotError, ValueError) as error:
                why = f"{error.title} {error.why}" if isinstance(error, BenchbotError) else f"{error}."
                left_out.append(f"{each.furniture.library}#{each.furniture.id}: {why}")
    finally:
        for library in libraries:
            library.__exit__()
    return sorted(models, key=lambda entry: entry["id"]), left_out


def _table() -> dict[str, dict[str, Any]]:
    table: dict[str, dict[str, Any]] = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_text("utf-8"))
    return table


def _wanted(library: Library, table: Mapping[str, Mapping[str, Any]]) -> Iterator[Wanted]:
    for furniture in library.furniture():
        said = table.get(furniture.library, {}).get(furniture.id, [])
        each = said if isinstance(said, list) else [said]
        for number, one in enumerate(each, 1):
            meant = {"class": one} if isinstance(one, str) else one
            suffix = f"{meant['class']} {number}" if isinstance(said, list) else ""
            yield Wanted(library, furniture, {**meant, "suffix": suffix})


def _asset(wanted: Wanted, folder: Path) -> Entry:
    """Convert one model, write its file, and return its entry in the catalogue."""
    furniture, said = wanted.furniture, wanted.said
    class_name = said.get("class")
    instance = Instance(1, wanted.id, class_name)
    with tempfile.TemporaryDirectory(prefix="benchbot-") as scratch:
        path = wanted.library.extract(furniture, Path(scratch))
        geometry = fitted(path, furniture, instance, said.get("part", ()), said.get("scale", 1.0))
    if len(geometry.triangles) > MAX_TRIANGLES:
        raise ValueError(f"it has {len(geometry.triangles)} triangles, and {MAX_TRIANGLES} at most are taken")
    data = to_glb(geometry)
    (folder / f"{wanted.id}.glb").write_bytes(data)
    kind = said.get("kind", class_name)
    size_m = [round(float(length), 4) for length in geometry.vertices.max(axis=0) - geometry.vertices.min(axis=0)]
    placement = "wall" if furniture.elevation_m >= _HANGS_FROM_M else "surface"
    if placement == "surface" and (kind in _STANDS_ON_THE_FLOOR or _is_tall_plant(kind, size_m)):
        placement = "floor"
    return {
        "id": wanted.id,
        "file": f"models/{wanted.id}.glb",
        "class": class_name,
        "kind": kind,
        "placement": placement,
        "size_m": size_m,
        "surfaces": [] if said.get("part") else _surfaces(furniture, class_name, size_m),
        "group": False,
        "triangles": len(geometry.triangles),
        "sha256": hashlib.sha256(data).hexdigest(),
        "licence": _licence(wanted.library),
        "author": furniture.creator,
        "source": f"{PACKAGE}: {furniture.library}#{furniture.id} ({furniture.name})",
    }


def _is_tall_plant(kind: str | None, size_m: Sequence[float]) -> bool:
    return kind == "potted plant" and size_m[2] >= _TALL_PLANT_M


def _surfaces(furniture: Furniture, class_name: str | None, size_m: Sequence[float]) -> list[Entry]:
    """Return the surfaces on which objects can stand, from the catalogue; every table has a top."""
    top_m = size_m[2] if furniture.top_m is None and class_name == "table" else furniture.top_m
    if top_m is None or top_m > size_m[2] + 1e-3 or class_name in ("chair", "couch", "bed", "toilet", "sink"):
        return []
    x, y = size_m[0] * (0.5 - _RIM), size_m[1] * (0.5 - _RIM)
    high_m = [round(x, 4), round(y, 4)]
    low_m = [-high_m[0], -high_m[1]]
    return [{"z_m": round(top_m, 4), "low_m": low_m, "high_m": high_m, "headroom_m": _HEADROOM_M}]


def _licence(library: Library) -> str:
    if "Public domain" in library.licence:
        return "CC0-1.0"
    return "CC-BY-3.0-US" if "United States" in library.licence else "CC-BY-3.0"


def _credits(models: Sequence[Entry]) -> str:
    lines = [
        f"3D models of the asset pack '{NAME}' for BenchBot",
        "",
        f"They come from Debian's package {PACKAGE} (Sweet Home 3D, http://www.sweethome3d.com), and were changed:",
        "converted to glTF, turned, scaled to their catalogue's sizes, textures reduced, materials adapted.",
        "CC0-1.0: https://creativecommons.org/publicdomain/zero/1.0/",
        "CC-BY-3.0: https://creativecommons.org/licenses/by/3.0/",
        "CC-BY-3.0-US: https://creativecommons.org/licenses/by/3.0/us/",
        "",
    ]
    lines += [f"{entry['id']}: by {entry['author']}, {entry['licence']}, {entry['source']}" for entry in models]
    return "\n".join(lines) + "\n"


def _listed(paths: Iterable[Path]) -> str:
    return ", ".join(path.name for path in paths)
