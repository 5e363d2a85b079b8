"""USD, in all its file formats, by Pixar's usd-core: what a stage shows at its default time.

Meshes (also instanced), boxes, UsdPreviewSurface materials with their textures, display colours. What is invisible, or
a guide, or a proxy, is left out, as the stage says.
"""

import types
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import files
from benchbot_scenes.importing.model import Model, Part, UpAxis, assemble
from benchbot_scenes.importing.polygons import triangulate
from benchbot_scenes.scene import ImageArray, Material

PLAIN = Material(name="plain", base_color=(0.6, 0.6, 0.6), roughness=0.9, double_sided=True)
PAINTED = Material(name="painted", base_color=(1.0, 1.0, 1.0), roughness=0.9, double_sided=True)
PAINTED_NUMBER = 1
CLEAR_BELOW = 0.5
_BOX = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_BOX_FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def read(path: Path) -> Model:
    """Read a USD file, which names its unit and up axis. Raises BenchbotError also without usd-core."""
    pxr = _library(path)
    if path.suffix.lower() == ".usdz":
        files.check_usdz(path)
    folder = files.Folder(path)
    quiet = pxr.UsdUtils.CoalescingDiagnosticDelegate()  # or warnings go to the terminal
    try:
        absent = _check_layers(pxr, path, folder)
        stage = pxr.Usd.Stage.Open(str(path))
        found = _Reader(pxr, stage, folder)
        parts = [part for prim in found.prims() for part in found.parts(prim)]
        unit_m = float(pxr.UsdGeom.GetStageMetersPerUnit(stage))
        up: UpAxis = "z" if pxr.UsdGeom.GetStageUpAxis(stage) == pxr.UsdGeom.Tokens.z else "y"
    except pxr.Tf.ErrorException as error:
        raise BenchbotError(
            f"{path.name} is not a valid USD file",
            "; ".join(dict.fromkeys(str(found.commentary) for found in error.args))[:300],
            "Export it again, or fetch it again if it was cut short.",
        ) from error
    finally:
        quiet.TakeUncoalescedDiagnostics()
    if not any(len(part.triangles) for part in parts):
        raise BenchbotError(
            f"{path.name} holds no triangles",
            "".join(f"It refers to {name}, which is not there. " for name in absent)
            + "No mesh of its stage is visible at the default time.",
            "Make its meshes visible, and load its layers into one file: usdcat --flatten IN.usd -o OUT.usdc",
        )
    notes = [*found.notes, *(f"It refers to {name}, which is not there." for name in absent)]
    notes += [f"The texture {name} is not there; a plain colour stands for it." for name in folder.missing]
    is_said = stage.HasAuthoredMetadata("metersPerUnit")
    return assemble(parts, found.materials, found.images, unit_m=unit_m if is_said else None, up=up, notes=notes)


def _library(path: Path) -> Any:
    try:
        from pxr import Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdShade, UsdUtils
    except ImportError as error:
        raise BenchbotError(
            f"{path.name} cannot be read",
            "USD files need the package usd-core, which is not installed.",
            'Run: pip install "benchbot-scenes[usd]"',
        ) from error
    return types.SimpleNamespace(
        Ar=Ar, Gf=Gf, Sdf=Sdf, Tf=Tf, Usd=Usd, UsdGeom=UsdGeom, UsdShade=UsdShade, UsdUtils=UsdUtils
    )


def _check_layers(pxr: Any, path: Path, folder: files.Folder) -> list[str]:
    """Refuse layers outside the file's folder before they are opened; returns those that are not there."""
    pending, seen = [str(path)], set[str]()
    missing: list[str] = []
    while pending:
        name = pending.pop()
        if name in seen:
            continue
        seen.add(name)
        layer = pxr.Sdf.Layer.OpenAsAnonymous(name)
        if path.suffix.lower() == ".usdz":
            for reference in layer.GetCompositionAssetDependencies():
                folder.find(reference)
            continue
        for reference in layer.GetCompositionAssetDependencies():
            relative = Path(name).parent.relative_to(path.parent) / reference
            found = folder.find(reference if reference.startswith("/") or "://" in reference else relative.as_posix())
            if found is None:
                missing.append(reference)
            else:
                pending.append(str(found))
    return missing


@dataclass
class _Reader:
    pxr: Any
    stage: Any
    folder: files.Folder
    materials: list[Material] = field(default_factory=lambda: [PLAIN, PAINTED])
    images: list[ImageArray] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._places = self.pxr.UsdGeom.XformCache()
        self._material_numbers: dict[str, int] = {}
        self._image_numbers: dict[str, int | None] = {}

    def prims(self) -> Iterator[Any]:
        """The visible prims, instances opened up."""
        geom = self.pxr.UsdGeom
        hidden = 0
        for prim in self.stage.Traverse(self.pxr.Usd.TraverseInstanceProxies()):
            if not (prim.IsA(geom.Mesh) or prim.IsA(geom.Cube)):
                continue
            shown = geom.Imageable(prim)
            is_visible = shown.ComputeVisibility() != geom.Tokens.invisible
            if is_visible and shown.ComputePurpose() in (geom.Tokens.default_, geom.Tokens.render):
                yield prim
            else:
                hidden += 1
        if hidden:
            self.notes.append(f"{hidden} meshes that the stage does not show are left out.")

    def parts(self, prim: Any) -> Iterator[Part]:
        """The triangles of a prim, by material."""
        geom = self.pxr.UsdGeom
        matrix = np.array(self._places.GetLocalToWorldTransform(prim))
        names = tuple(step for step in str(prim.GetPath()).split("/") if step)
        if prim.IsA(geom.Cube):
            size = float(geom.Cube(prim).GetSizeAttr().Get() or 2.0)
            points = (_BOX * size) @ matrix[:3, :3] + matrix[3, :3]
            color = self._display_colors(prim, 1, 1)
            yield Part(
                names,
                points,
                _BOX_FACES.ravel()[triangulate(_BOX_FACES, points)],
                self._material(prim) if color is None else PAINTED_NUMBER,
                colors=None if color is None else np.broadcast_to(color[0], (8, 3)),
            )
            return
        mesh = geom.Mesh(prim)
        counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
        corners = np.asarray(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
        points = np.asarray(mesh.GetPointsAttr().Get() or np.zeros((0, 3)), np.float64).reshape(-1, 3)
        if counts.sum() != len(corners) or (len(corners) and (corners.min() < 0 or corners.max() >= len(points))):
            self.notes.append(f"The mesh {'/'.join(names)} is damaged and left out.")
            return
        if len(corners) == 0:
            return
        points = points @ matrix[:3, :3] + matrix[3, :3]
        is_flipped = (mesh.GetOrientationAttr().Get() == geom.Tokens.leftHanded) != (np.linalg.det(matrix[:3, :3]) < 0)
        places, face = _triangles(counts, corners, points)
        if is_flipped:
            places = places[:, ::-1]
        uvs = self._uvs(prim, counts, corners)
        colors = self._display_colors(prim, len(points), len(counts))
        for number, chosen in self._by_material(mesh, len(counts)):
            mine = places[chosen[face]]
            if len(mine) == 0:
                continue
            yield self._part(names, number, mine, points, corners, uvs, colors, face[chosen[face]])

    def _part(
        self,
        names: tuple[str, ...],
        material: int,
        places: npt.NDArray[np.int64],
        points: npt.NDArray[np.float64],
        corners: npt.NDArray[np.int64],
        uvs: npt.NDArray[np.float64] | None,
        colors: npt.NDArray[np.float64] | None,
        face: npt.NDArray[np.int64],
    ) -> Part:
        """Corners with texture coordinates of their own become vertices of their own."""
        is_textured = self.materials[material].base_color_image is not None
        painted = None
        if colors is not None and not is_textured and material == 0:
            by = {len(points): corners[places], len(corners): places}.get(len(colors))
            painted = colors[by] if by is not None else np.repeat(colors[face][:, None], 3, axis=1)
            material = PAINTED_NUMBER
        if uvs is None or not is_textured:
            return Part(names, points, corners[places], material, colors=painted)
        pairs, vertex = np.unique(np.column_stack([corners, uvs]), axis=0, return_inverse=True)
        return Part(names, points[pairs[:, 0].astype(np.int64)], vertex.reshape(-1)[places], material, uvs=pairs[:, 1:])

    def _by_material(self, mesh: Any, faces: int) -> Iterator[tuple[int, npt.NDArray[np.bool_]]]:
        """Numbers of materials with the faces that have them."""
        binding = self.pxr.UsdShade.MaterialBindingAPI(mesh)
        left = np.ones(faces, bool)
        for subset in binding.GetMaterialBindSubsets():
            mine = np.zeros(faces, bool)
            chosen = np.asarray(subset.GetIndicesAttr().Get() or [], np.int64)
            mine[chosen[(chosen >= 0) & (chosen < faces)]] = True
            mine &= left
            left &= ~mine
            yield self._material(subset.GetPrim()), mine
        yield self._material(mesh.GetPrim()), left

    def _uvs(
        self, prim: Any, counts: npt.NDArray[np.int64], corners: npt.NDArray[np.int64]
    ) -> npt.NDArray[np.float64] | None:
        """Texture coordinates of corners, row 0 of images at v = 0."""
        primvars = self.pxr.UsdGeom.PrimvarsAPI(prim)
        for name in ("st", "UVMap", "st0", "map1", "Texture_uv"):
            primvar = primvars.FindPrimvarWithInheritance(name)
            values = np.asarray(primvar.ComputeFlattened() if primvar else None, np.float64)
            if values.ndim != 2 or values.shape[1] != 2:
                continue
            if len(values) != len(corners) and len(values) > corners.max():
                values = values[corners]
            if len(values) == len(corners):
                return values * [1.0, -1.0] + [0.0, 1.0]
        return None

    def _display_colors(self, prim: Any, points: int, faces: int) -> npt.NDArray[np.float64] | None:
        """Linear colours of points, corners or faces."""
        values = self.pxr.UsdGeom.Gprim(prim).GetDisplayColorPrimvar().ComputeFlattened()
        if not values:
            return None
        colors = np.asarray(values, np.float64)
        return np.broadcast_to(colors, (faces, 3)) if len(colors) == 1 and points > 1 else colors

    def _material(self, prim: Any) -> int:
        bound = self.pxr.UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        if not bound:
            return 0
        key = str(bound.GetPath())
        if key not in self._material_numbers:
            surface = bound.ComputeSurfaceSource()[0]
            self._material_numbers[key] = len(self.materials)
            self.materials.append(self._described(bound.GetPrim().GetName(), surface) if surface else PLAIN)
        return self._material_numbers[key]

    def _described(self, name: str, surface: Any) -> Material:
        """A UsdPreviewSurface (UsdPreviewSurface specification 2.6); inputs of other shaders by the same names."""
        image = self._texture(surface, "diffuseColor")
        opacity = self._number(surface, "opacity", 1.0)
        return Material(
            name=name,
            base_color=(1.0, 1.0, 1.0) if image is not None else self._color(surface, "diffuseColor", 0.18),
            base_color_image=image,
            metallic=self._number(surface, "metallic", 0.0),
            roughness=self._number(surface, "roughness", 0.5),
            normal_image=self._texture(surface, "normal"),
            emission=self._color(surface, "emissiveColor", 0.0),
            transmission=1.0 if opacity < CLEAR_BELOW else 0.0,
            refractive_index=self._number(surface, "ior", 1.5),
            double_sided=True,
        )

    def _value(self, surface: Any, name: str) -> Any:
        shader_input = surface.GetInput(name)
        sources = shader_input.GetValueProducingAttributes() if shader_input else ()
        return sources[0].Get() if sources else None

    def _number(self, surface: Any, name: str, otherwise: float) -> float:
        value = self._value(surface, name)
        return float(value) if isinstance(value, int | float) else otherwise

    def _color(self, surface: Any, name: str, otherwise: float) -> tuple[float, float, float]:
        value = self._value(surface, name)
        if not isinstance(value, self.pxr.Gf.Vec3f):
            return (otherwise, otherwise, otherwise)
        return (float(value[0]), float(value[1]), float(value[2]))

    def _texture(self, surface: Any, name: str) -> int | None:
        """The number of the image that an input looks up (a UsdUVTexture), if any."""
        shader_input = surface.GetInput(name)
        if not shader_input or not shader_input.HasConnectedSource():
            return None
        source = self.pxr.UsdShade.Shader(shader_input.GetConnectedSources()[0][0].source.GetPrim())
        asset = self._value(source, "file") if source else None
        if not isinstance(asset, self.pxr.Sdf.AssetPath) or not asset.path:
            return None
        if asset.path not in self._image_numbers:
            data = self._bytes(asset)
            self._image_numbers[asset.path] = files.decode_texture(data, asset.path, self.images, self.notes)
        return self._image_numbers[asset.path]

    def _bytes(self, asset: Any) -> bytes | None:
        resolved = str(asset.resolvedPath)
        if "[" not in resolved:
            relative = Path(resolved)
            root = Path(self.stage.GetRootLayer().realPath).parent
            within = resolved and relative.is_absolute() and relative.is_relative_to(root)
            return self.folder.read_texture(relative.relative_to(root).as_posix() if within else asset.path)
        opened = self.pxr.Ar.GetResolver().OpenAsset(self.pxr.Ar.ResolvedPath(resolved))
        return bytes(opened.GetBuffer()) if opened else None


def _triangles(
    counts: npt.NDArray[np.int64], corners: npt.NDArray[np.int64], points: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Places in `corners` (T, 3), and the face of each triangle."""
    start = np.cumsum(counts) - counts
    places, faces = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    for count in np.unique(counts[counts >= 3]):
        chosen = np.flatnonzero(counts == count)
        place = start[chosen][:, None] + np.arange(count)
        places.append(place.ravel()[triangulate(corners[place], points)])
        faces.append(np.repeat(chosen, count - 2))
    return np.concatenate(places), np.concatenate(faces)
