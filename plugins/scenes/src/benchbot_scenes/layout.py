"""Layouts: what stands where in a scene, as data that a person can read and change. See docs/scenes.md."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

import yaml

from benchbot.plugin import BenchbotError, check_declaration, read_declaration

Point = tuple[float, float]
OpeningKind = Literal["door", "window", "passage"]


@dataclass(frozen=True)
class Room:
    """A room of a building: `outline` is its inner floor polygon (metres, map frame), rectilinear, without holes.

    `floor`, `walls` and `ceiling` name finishes (see `finishes`), or give a paint as "#rrggbb".
    """

    name: str
    outline: tuple[Point, ...]
    floor: str
    walls: str
    ceiling: str


@dataclass(frozen=True)
class Opening:
    """A hole in a wall, `at` the middle of its width, anywhere within the wall's thickness.

    A door or window is filled with the model (or a fitting one of the pack when that is None); a passage stays empty.
    `open_deg` turns a door's leaf about its hinge.
    """

    name: str
    kind: OpeningKind
    at: Point
    width_m: float
    bottom_m: float
    top_m: float
    model: str | None = None
    open_deg: float = 0.0


@dataclass(frozen=True)
class Building:
    """Rooms with what is between them: walls `wall_m` thick (inner ones as thick as the gap), one height for all."""

    height_m: float
    wall_m: float
    rooms: tuple[Room, ...]
    openings: tuple[Opening, ...]


@dataclass(frozen=True)
class Placement:
    """A model in the scene: the middle of its box's bottom face at `position`, turned `yaw_deg` about z.

    `size_m` scales it along its own axes (before it is turned) to that box; None leaves its own size. `class_name` and
    `is_group` override the catalogue's when not None; `class_name` "" means that no map names it.
    """

    id: str
    model: str
    position: tuple[float, float, float]
    yaw_deg: float = 0.0
    size_m: tuple[float, float, float] | None = None
    class_name: str | None = None
    is_group: bool | None = None


@dataclass(frozen=True)
class Move:
    """An object of the base that stands elsewhere: the middle of its box's bottom face, and a further turn about z."""

    id: str
    position: tuple[float, float, float]
    turn_deg: float = 0.0


@dataclass(frozen=True)
class Layout:
    """A scene: a building and its objects, or the differences to a `base` (another layout, or a finished GLB file).

    `removed` and `moved` name objects of the base by id (a GLB's instance names); `objects` are added. `assets` is the
    pack that models are taken from.
    """

    assets: str
    building: Building | None = None
    objects: tuple[Placement, ...] = ()
    base: Path | None = None
    removed: tuple[str, ...] = ()
    moved: tuple[Move, ...] = ()


def read_layout(path: Path) -> Layout:
    """Read a layout's YAML; raises BenchbotError naming file, line and key when it is not one (see layout.json)."""
    document = read_declaration(path)
    check_declaration(document, "layout", path, _SCHEMAS)
    if not _is_finite(document):
        raise BenchbotError(f"{path} is not a valid layout.", "It holds .nan or .inf.", "Give numbers in their place.")
    if ("building" in document) == ("base" in document):
        has = "both" if "base" in document else "neither"
        raise BenchbotError(
            f"{path} is not a valid layout.",
            f"A layout says what is built ('building') or what it differs from ('base'); this one says {has}.",
            "Give one of the two keys.",
        )
    return from_document(document, path.parent)


def write_layout(path: Path, layout: Layout) -> None:
    """Write a layout so that `read_layout` gives it back; numbers to a tenth of a millimetre."""
    document = to_document(layout, path.parent)
    text = yaml.dump(document, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=120, allow_unicode=True)
    path.write_text(text, encoding="utf-8")


def from_document(document: Mapping[str, Any], folder: Path) -> Layout:
    """The layout that a checked document stands for; `base` is relative to `folder`."""
    return Layout(
        assets=document["assets"],
        building=_building(document["building"]) if "building" in document else None,
        objects=tuple(_placement(entry) for entry in document.get("objects", ())),
        base=folder / document["base"] if "base" in document else None,
        removed=tuple(document.get("removed", ())),
        moved=tuple(_move(entry) for entry in document.get("moved", ())),
    )


def to_document(layout: Layout, folder: Path) -> dict[str, Any]:
    """The layout as plain data, without what is left at its default; `base` becomes relative to `folder`."""
    document: dict[str, Any] = {"assets": layout.assets}
    if layout.base is not None:
        document["base"] = Path(os.path.relpath(layout.base, folder)).as_posix()
    if layout.building is not None:
        document["building"] = {
            "height_m": _rounded(layout.building.height_m),
            "wall_m": _rounded(layout.building.wall_m),
            "rooms": [{**vars(room), "outline": _rounded(room.outline)} for room in layout.building.rooms],
            "openings": [_entry(opening) for opening in layout.building.openings],
        }
    parts = {
        "removed": list(layout.removed),
        "moved": [_entry(move) for move in layout.moved],
        "objects": [_entry(placement) for placement in layout.objects],
    }
    return document | {key: part for key, part in parts.items() if part}


def _is_finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(map(_is_finite, value.values()))
    if isinstance(value, list):
        return all(map(_is_finite, value))
    return not isinstance(value, float) or math.isfinite(value)


_SCHEMAS = Path(__file__).parent
_KEYS = {"class_name": "class", "is_group": "group"}


class _Dumper(yaml.SafeDumper):
    """Without the anchors that YAML puts where a list occurs twice."""

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_str(self, data: str) -> yaml.ScalarNode:
        """Escape the line breaks of Unicode, which a YAML reader would take for spaces in all but double quotes."""
        style = '"' if _BREAKS.intersection(data) else None
        return self.represent_scalar("tag:yaml.org,2002:str", data, style)


_BREAKS = frozenset("\x85\u2028\u2029")
_Dumper.add_representer(str, _Dumper.represent_str)


def _entry(record: Opening | Placement | Move) -> dict[str, Any]:
    """A record's document, without what is at its default."""
    defaults = {field.name: field.default for field in fields(record)}
    values = {name: value for name, value in vars(record).items() if value != defaults[name]}
    return {_KEYS.get(name, name): _rounded(value) for name, value in values.items()}


def _rounded(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_rounded(part) for part in value]
    return round(float(value), 4) + 0.0 if isinstance(value, int | float) and not isinstance(value, bool) else value


def _building(entry: Mapping[str, Any]) -> Building:
    return Building(
        float(entry["height_m"]),
        float(entry["wall_m"]),
        tuple(Room(**{**room, "outline": tuple(map(_point, room["outline"]))}) for room in entry["rooms"]),
        tuple(_opening(opening) for opening in entry.get("openings", ())),
    )


def _opening(entry: Mapping[str, Any]) -> Opening:
    return Opening(
        name=entry["name"],
        kind=entry["kind"],
        at=_point(entry["at"]),
        width_m=float(entry["width_m"]),
        bottom_m=float(entry["bottom_m"]),
        top_m=float(entry["top_m"]),
        model=entry.get("model"),
        open_deg=float(entry.get("open_deg", 0.0)),
    )


def _placement(entry: Mapping[str, Any]) -> Placement:
    return Placement(
        id=entry["id"],
        model=entry["model"],
        position=_triple(entry["position"]),
        yaw_deg=float(entry.get("yaw_deg", 0.0)),
        size_m=_triple(entry["size_m"]) if "size_m" in entry else None,
        class_name=entry.get("class"),
        is_group=entry.get("group"),
    )


def _move(entry: Mapping[str, Any]) -> Move:
    return Move(entry["id"], _triple(entry["position"]), float(entry.get("turn_deg", 0.0)))


def _point(values: Sequence[float]) -> Point:
    x, y = values
    return float(x), float(y)


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)
