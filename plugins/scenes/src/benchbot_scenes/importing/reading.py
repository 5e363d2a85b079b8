"""The reader of each file format."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchbot.plugin import BenchbotError, did_you_mean
from benchbot_scenes.importing import files
from benchbot_scenes.importing.model import Model, renamed, turned
from benchbot_scenes.importing.sanity import sound

_USD = (".usd", ".usda", ".usdc", ".usdz")
SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl", *_USD)
_HINTS = {
    ".blend": "In Blender: File, Export, glTF 2.0 (.glb).",
    ".skp": "In SketchUp: File, Export, 3D Model, glTF binary (.glb).",
    ".fbx": "Import it into Blender, then: File, Export, glTF 2.0 (.glb).",
    ".dae": "Import it into Blender, then: File, Export, glTF 2.0 (.glb).",
    ".zip": "Unpack it and name the scene's file in it.",
    ".las": "It is a point cloud: make a mesh of it first, for example with CloudCompare (Poisson).",
    ".e57": "It is a point cloud: make a mesh of it first, for example with CloudCompare (Poisson).",
}


def read(path: Path) -> Model:
    """Read a scene's file, in its own unit and axes.

    Raises BenchbotError when it is missing, empty, damaged, without triangles, of no known kind, or reaches outside
    its folder.
    """
    files.check(path)
    reader = _reader(path)
    try:
        model = reader(path)
    except MemoryError as error:
        raise BenchbotError(
            f"{path} does not fit into memory", "It asks for more than there is.", "Decimate it, or fetch it again."
        ) from error
    return sound(renamed(model, path.stem), path)


def _reader(path: Path) -> Callable[[Path], Model]:
    suffix = path.suffix.lower()
    if suffix in (".glb", ".gltf"):
        return _read_gltf
    if suffix == ".obj":
        from benchbot_scenes.importing import obj

        return obj.read
    if suffix in (".ply", ".stl"):
        from benchbot_scenes.importing import scans

        return scans.read
    if suffix in _USD:
        from benchbot_scenes.importing import usd

        return usd.read
    raise BenchbotError(
        f"{path.name} is of no kind that can be imported",
        f"Known are {', '.join(SUFFIXES)}.{did_you_mean(suffix, list(SUFFIXES)) if suffix else ''}",
        _HINTS.get(suffix, "Export the scene as GLB (glTF 2.0 binary), which holds everything in one file."),
    )


def _read_gltf(path: Path) -> Model:
    import json

    from benchbot_scenes.gltf import Y_UP_TO_Z_UP, geometry_of
    from benchbot_scenes.gltf_file import BROKEN, GltfFile, UnsupportedError, split_glb

    data = path.read_bytes()
    folder = files.Folder(path)
    try:
        document, binary = split_glb(data) if data[:4] == b"glTF" else (json.loads(data), b"")
        geometry, paths = geometry_of(GltfFile(document, binary, folder.read))
    except UnsupportedError as error:
        raise BenchbotError(
            f"{path.name} cannot be used", str(error), "Export it again without that feature."
        ) from error
    except BROKEN as error:
        raise BenchbotError(
            f"{path.name} is not a valid glTF 2.0 file",
            f"{type(error).__name__}: {error}",
            "Export it again as binary glTF 2.0 (.glb), or fetch it again if it was cut short.",
        ) from error
    # As the file has it: y up, and metres by the standard, which not every exporter keeps to.
    return Model(turned(geometry, np.asarray(Y_UP_TO_Z_UP.T)), paths, unit_m=None, up="y")
