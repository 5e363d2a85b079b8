"""What a bake hands over: triangles with their surfaces, kept in a NumPy archive between the two Pythons."""

import json
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Surface:
    """A glTF material: factors, and `images` (H, W, 3) by role (base_color, metallic_roughness, normal)."""

    name: str
    base_color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    metallic: float = 1.0
    roughness: float = 1.0
    transmission: float = 0.0
    emission: tuple[float, float, float] = (0.0, 0.0, 0.0)
    images: dict[str, Picture] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """Triangles of one surface, three corners each: positions (3 T, 3) z up, normals (3 T, 3), uvs (3 T, 2) v up."""

    positions: Floats
    normals: Floats
    uvs: Floats
    surface: Surface


def save_parts(path: Path, parts: list[Part]) -> None:
    """Write the archive."""
    arrays: dict[str, Any] = {}
    for index, part in enumerate(parts):
        corners = {"positions": part.positions, "normals": part.normals, "uvs": part.uvs}
        arrays |= {f"{index}.{name}": values.astype(np.float32) for name, values in corners.items()}
        arrays |= {f"{index}.image.{role}": image for role, image in part.surface.images.items()}
        surface = asdict(replace(part.surface, images={}))
        arrays[f"{index}.surface"] = np.array(json.dumps(surface))
    np.savez_compressed(path, **arrays)


def load_parts(path: Path) -> list[Part]:
    """Read the archive."""
    with np.load(path) as archive:
        names = list(archive)
        parts = []
        for index in range(sum(name.endswith(".surface") for name in names)):
            listed: dict[str, Any] = json.loads(str(archive[f"{index}.surface"]))
            fields: dict[str, Any] = {
                name: tuple(value) if isinstance(value, list) else value for name, value in listed.items()
            }
            start = f"{index}.image."
            fields["images"] = {name.removeprefix(start): archive[name] for name in names if name.startswith(start)}
            positions, normals, uvs = (archive[f"{index}.{name}"] for name in ("positions", "normals", "uvs"))
            parts.append(Part(positions.astype(float), normals.astype(float), uvs.astype(float), Surface(**fields)))
    return parts
