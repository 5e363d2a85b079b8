"""A file understood: brought to metres, z up, its floor at z = 0, its objects named and sorted into classes."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import guesses, guessing, objects, placing, reading
from benchbot_scenes.importing.glb import to_glb
from benchbot_scenes.importing.guesses import Guesses
from benchbot_scenes.importing.model import UpAxis
from benchbot_scenes.importing.objects import Recognised
from benchbot_scenes.importing.sides import with_sides
from benchbot_scenes.scene import SceneGeometry

LARGEST_M, SMALLEST_M = 2000.0, 0.5
_MOSTLY_Y_UP = (".obj",)


@dataclass(frozen=True)
class Understood:
    """A scene in the map frame with what it was taken for, and why (`reasons`, by the keys of a guesses file)."""

    geometry: SceneGeometry
    unit: str | float
    up: UpAxis
    floor_z_m: float
    recognised: Recognised
    reasons: dict[str, str]
    notes: tuple[str, ...]

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Along x, y and z."""
        x, y, z = np.ptp(self.geometry.vertices, axis=0)
        return float(x), float(y), float(z)


def convert(path: Path) -> bytes:
    """Any importable file as a GLB file in metres, its floor at z = 0; what lies beside it as guesses counts.

    Raises BenchbotError when it cannot be read.
    """
    return to_glb(understand(path, guesses.beside(path)).geometry)


def understand(path: Path, known: Guesses) -> Understood:
    """Read a file and guess what is not `known`; raises BenchbotError when it is not a scene."""
    model = reading.read(path)
    suffix = path.suffix.lower()
    reasons = {}
    up, unit = known.up, known.units
    if up is None:
        up, reasons["up"] = guessing.up_axis(model, "y" if suffix in _MOSTLY_Y_UP else "z")
    recognised = objects.recognise(model.paths, model.geometry.instances, known.classes, known.hidden)
    seen = objects.sorted_into(model.geometry, recognised)
    paths = tuple((found.name,) for found in recognised.objects)
    unit_m = known.unit_m
    if unit_m is None and model.unit_m is not None:
        unit_m, reasons["units"] = model.unit_m, "the file says so"
        unit = next((name for name, size in guessing.UNITS_M.items() if np.isclose(size, unit_m)), unit_m)
    elif unit_m is None:
        upright = placing.upright(seen, 1.0, up)
        unit, reasons["units"] = guessing.unit(upright, paths, is_gltf=suffix in (".glb", ".gltf"))
        unit_m = guessing.UNITS_M[unit]
    geometry = placing.upright(seen, unit_m, up)
    _check_size(geometry, path)
    floor_z_m = known.floor_z_m
    if floor_z_m is None:
        floor_z_m, reasons["floor_z_m"] = guessing.floor_z_m(geometry)
    geometry = placing.shifted(geometry, (0.0, 0.0, -floor_z_m))
    return Understood(with_sides(geometry), unit or unit_m, up, floor_z_m, recognised, reasons, model.notes)


def _check_size(geometry: SceneGeometry, path: Path) -> None:
    size = np.ptp(geometry.vertices, axis=0)
    if size[:2].max() > LARGEST_M or size[:2].max() < SMALLEST_M:
        what = "large" if size[:2].max() > LARGEST_M else "small"
        raise BenchbotError(
            f"{path.name} is too {what} for a place that a robot moves in",
            f"It is {size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} m.",
            "Say which unit it has (--units), or take away what lies far off.",
        )
