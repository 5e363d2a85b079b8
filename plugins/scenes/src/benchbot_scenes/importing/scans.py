"""PLY (Stanford) and STL: what scanners and CAD programs write, read by trimesh."""

import io
import struct
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing.files import Folder
from benchbot_scenes.importing.model import Model, Part, assemble
from benchbot_scenes.scene import ImageArray, Material
from benchbot_scenes.vertex_colors import srgb_to_linear

PLAIN = Material(name="plain", base_color=(0.6, 0.6, 0.6), roughness=0.9, double_sided=True)
PAINTED = Material(name="painted", base_color=(1.0, 1.0, 1.0), roughness=0.9, double_sided=True)


class _Beside:
    """The resolver that trimesh asks for files beside a scan."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder

    def get(self, name: str) -> bytes:
        data = self._folder.read_texture(name)
        if data is None:
            raise FileNotFoundError(name)
        return data

    __getitem__ = get


def read(path: Path) -> Model:
    """Read a PLY or STL file with the colours of its vertices, faces or texture; neither unit nor up axis are known."""
    import trimesh

    folder = Folder(path)
    data = path.read_bytes()
    kind = path.suffix.lower().removeprefix(".")
    _check_length(path, kind, data)
    try:
        with np.errstate(all="ignore"):  # what is no place is left out later
            loaded = trimesh.load(
                io.BytesIO(data),
                file_type=kind,
                process=False,
                resolver=_Beside(folder),  # type: ignore[arg-type]
            )
        meshes = loaded.geometry if isinstance(loaded, trimesh.Scene) else {path.stem: loaded}
        found = [(name, mesh) for name, mesh in meshes.items() if len(getattr(mesh, "faces", ()))]
    except BenchbotError:
        raise
    except (ValueError, LookupError, TypeError, AttributeError, OSError, OverflowError, struct.error) as error:
        raise _broken(path, kind, f"{type(error).__name__}: {error}") from error
    if not found:
        raise BenchbotError(
            f"{path.name} holds no triangles",
            "It is a point cloud, or was cut short.",
            "Make a mesh of the points first, for example with CloudCompare (Poisson surface reconstruction).",
        )
    materials, images = [PLAIN, PAINTED], list[ImageArray]()
    parts = [_part(str(name), mesh, materials, images) for name, mesh in found]
    if any(part.triangles.min() < 0 or part.triangles.max() >= len(part.vertices) for part in parts):
        raise _broken(path, kind, "A triangle names a vertex that is not there.")
    missing = [f"The texture {name} is not there; grey stands for it." for name in folder.missing]
    return assemble(parts, materials, images, notes=missing)


def _part(name: str, mesh: Any, materials: list[Material], images: list[ImageArray]) -> Part:
    part = Part((name,), np.asarray(mesh.vertices), np.asarray(mesh.faces), 0)
    kind = mesh.visual.kind
    if kind == "texture":
        image = getattr(mesh.visual.material, "image", None)
        if image is None or mesh.visual.uv is None:
            return part
        images.append(np.asarray(image.convert("RGBA")))
        materials.append(Material("textured", (1.0, 1.0, 1.0), len(images) - 1, roughness=0.9, double_sided=True))
        uvs = np.asarray(mesh.visual.uv)[:, :2] * [1.0, -1.0] + [0.0, 1.0]
        return Part(part.path, part.vertices, part.triangles, len(materials) - 1, uvs=uvs)
    if kind == "vertex":
        colors = srgb_to_linear(np.asarray(mesh.visual.vertex_colors)[:, :3] / 255.0)
        return Part(part.path, part.vertices, part.triangles, 1, colors=colors)
    if kind == "face":
        faces = srgb_to_linear(np.asarray(mesh.visual.face_colors)[:, :3] / 255.0)
        return Part(part.path, part.vertices, part.triangles, 1, colors=np.repeat(faces[:, None], 3, axis=1))
    return part


def _check_length(path: Path, kind: str, data: bytes) -> None:
    """Check the length of binary STL against its number of triangles: 50 bytes each after a head of 84."""
    if kind != "stl" or len(data) < 84 or data[:5] == b"solid":
        return
    (count,) = struct.unpack_from("<I", data, 80)
    if len(data) < 84 + 50 * count:
        have = (len(data) - 84) // 50
        raise _broken(path, kind, f"It should have {count:,} triangles but ends after {have:,}.")


def _broken(path: Path, kind: str, why: str) -> BenchbotError:
    return BenchbotError(
        f"{path.name} is not a valid {kind.upper()} file",
        why,
        "Export it again, or fetch it again if it was cut short.",
    )
