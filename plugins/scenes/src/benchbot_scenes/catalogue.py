"""Asset packs: catalogues of models, and how a model is chosen from one."""

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from benchbot.plugin import BenchbotError, did_you_mean, load_plugins
from benchbot_scenes.variations import (
    SEPARATOR,
    VARIATIONS,
    Palette,
    SurfaceFinish,
    Varying,
    Vector,
    read_palettes,
    varying,
)

PLACEMENTS = ("floor", "surface", "wall", "ceiling", "opening")
FINISHES = "finishes.glb"
"""The file of a pack's finishes, beside its catalogue."""
LOOKS = "looks.glb"
"""The file of the materials that the finishes of variations take their textures from, beside the catalogue."""

_NUMBERS = frozenset(map(str, range(1, VARIATIONS)))


@dataclass(frozen=True)
class Surface:
    """A horizontal rectangle of a model that things can stand on, in the model's frame, in metres."""

    z_m: float
    low_m: tuple[float, float]
    high_m: tuple[float, float]
    headroom_m: float


@dataclass(frozen=True)
class AssetModel:
    """One model of a pack: a GLB file of one object.

    Its frame has z up (in the file y up, as glTF demands) and faces +x; the origin is the middle of its box's bottom
    face. `size_m` is its box along x, y and z. `class_name` is None for what no map of objects names; `kind` says what
    it is in a word or two ("floor lamp"). What hangs on a wall has its back at x = -size_m[0] / 2.

    `varies` says how its variations differ from it, if it has any. A variation is a model with an id of its own and the
    same file: `scale` makes its `size_m` and `surfaces` of the file's, `finish` has an entry for each material of the
    file that it changes, with textures from the file `looks`.
    """

    id: str
    file: Path
    class_name: str | None
    kind: str
    placement: str
    size_m: tuple[float, float, float]
    surfaces: tuple[Surface, ...]
    is_group: bool
    triangles: int
    licence: str
    author: str
    source: str
    varies: Varying | None = None
    looks: Path | None = None
    scale: Vector = (1.0, 1.0, 1.0)
    finish: tuple[SurfaceFinish | None, ...] = ()

    @property
    def base_id(self) -> str:
        """The id without the number of a variation."""
        return self.id if self.varies is None else self.id.partition(SEPARATOR)[0]

    @property
    def number(self) -> int:
        """The number of the variation; 0 for the model as it is."""
        return int(self.id.removeprefix(self.base_id).removeprefix(SEPARATOR) or 0)

    def variation(self, number: int) -> "AssetModel":
        """The variation of a number from 1 to `VARIATIONS` - 1 of a model that varies; 0 gives itself."""
        if self.varies is None or number == 0:
            return self
        scale = self.varies.scale(self.id, number)
        x, y, z = (round(length * factor, 4) for length, factor in zip(self.size_m, scale, strict=True))
        return replace(
            self,
            id=f"{self.id}{SEPARATOR}{number}",
            size_m=(x, y, z),
            surfaces=tuple(_scaled(surface, scale) for surface in self.surfaces),
            scale=scale,
            finish=self.varies.finish(number),
        )


@dataclass(frozen=True)
class Catalogue:
    """The models of one pack, by id, and the file of its finishes if it has one (see `finishes`)."""

    name: str
    models: Mapping[str, AssetModel]
    finishes: Path | None = None

    def model(self, model_id: str) -> AssetModel:
        """The model of an id, or the variation of one: `chair~7`. Raises BenchbotError when the pack has none."""
        if model_id in self.models:
            return self.models[model_id]
        name, _, number = model_id.partition(SEPARATOR)
        base = self.models.get(name)
        if base is None:
            raise BenchbotError(
                f"The asset pack '{self.name}' has no model '{model_id}'",
                f"It has {len(self.models)} models.{did_you_mean(name, list(self.models))}",
                f"Take a name from 'benchbot assets list {self.name}'.",
            )
        if base.varies is None or number not in _NUMBERS:
            reason = "This model has none" if base.varies is None else f"They are numbered 1 to {VARIATIONS - 1}"
            raise BenchbotError(
                f"The model '{name}' of the asset pack '{self.name}' has no variation '{number}'.",
                f"{reason}; '{name}' itself is the model as it is.",
                f"Name it '{name}'." if base.varies is None else f"Name it '{name}', or '{name}{SEPARATOR}7'.",
            )
        return base.variation(int(number))

    def of_class(self, class_name: str) -> list[AssetModel]:
        """All models of a class, sorted by id."""
        return sorted((m for m in self.models.values() if m.class_name == class_name), key=lambda model: model.id)

    def of_kind(self, kind: str) -> list[AssetModel]:
        """All models of a kind, sorted by id."""
        return sorted((model for model in self.models.values() if model.kind == kind), key=lambda model: model.id)

    def stand_in(
        self,
        class_name: str,
        key: str,
        placement: str | None = None,
        accepts: Callable[[AssetModel], bool] = lambda model: True,
    ) -> AssetModel | None:
        """The model of a class that stands in for an object of another pack; always the same for the same `key`.

        One that `accepts` says yes to, and for the same `placement` where there is any: no alarm clock for a clock on a
        wall. None when there is no model.
        """
        models = [model for model in self.of_class(class_name) if accepts(model)]
        models = [model for model in models if model.placement == placement] or models
        if not models:
            return None
        return models[int.from_bytes(hashlib.sha256(key.encode()).digest()[:8], "big") % len(models)]


def packs() -> dict[str, Path]:
    """The installed packs: each name with its catalogue's file."""
    return {name: found.value.catalogue for name, found in load_plugins().pool("asset_packs").items()}


def pack(name: str) -> Catalogue:
    """An installed pack's catalogue; raises BenchbotError when there is no such pack."""
    installed = packs()
    if name not in installed:
        raise BenchbotError(
            f"There is no asset pack '{name}'.",
            f"Installed: {', '.join(sorted(installed)) or 'none'}.{did_you_mean(name, list(installed))}",
            "Install it: 'pip install benchbot-assets-household' brings 'household', "
            "'benchbot assets install NAME' the others.",
        )
    return load_catalogue(installed[name])


@cache
def load_catalogue(path: Path) -> Catalogue:
    """Read a pack's catalogue.json; raises BenchbotError when it is missing or broken."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        palettes = read_palettes(document.get("palettes", {}))
        models = [_model(entry, path.parent, palettes) for entry in document["models"]]
        finishes = path.with_name(FINISHES)
        return Catalogue(
            document["name"], {model.id: model for model in models}, finishes if finishes.is_file() else None
        )
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise BenchbotError(
            f"The catalogue of an asset pack cannot be read: {path}",
            f"{type(error).__name__}: {error}",
            "Install the asset pack again.",
        ) from error


def _model(entry: Mapping[str, Any], folder: Path, palettes: Mapping[str, Palette]) -> AssetModel:
    x, y, z = entry["size_m"]
    return AssetModel(
        id=entry["id"],
        file=folder / entry["file"],
        class_name=entry["class"],
        kind=entry["kind"],
        placement=entry["placement"],
        size_m=(float(x), float(y), float(z)),
        surfaces=tuple(_surface(surface) for surface in entry.get("surfaces", ())),
        is_group=bool(entry.get("group", False)),
        triangles=int(entry["triangles"]),
        licence=entry["licence"],
        author=entry["author"],
        source=entry["source"],
        varies=varying(entry["varies"], palettes) if "varies" in entry else None,
        looks=folder / LOOKS if "varies" in entry else None,
    )


def _surface(entry: Mapping[str, Any]) -> Surface:
    low, high = entry["low_m"], entry["high_m"]
    return Surface(
        float(entry["z_m"]),
        (float(low[0]), float(low[1])),
        (float(high[0]), float(high[1])),
        float(entry["headroom_m"]),
    )


def _scaled(surface: Surface, scale: Vector) -> Surface:
    return Surface(
        round(surface.z_m * scale[2], 4),
        (round(surface.low_m[0] * scale[0], 4), round(surface.low_m[1] * scale[1], 4)),
        (round(surface.high_m[0] * scale[0], 4), round(surface.high_m[1] * scale[1], 4)),
        round(surface.headroom_m * scale[2], 4),
    )
