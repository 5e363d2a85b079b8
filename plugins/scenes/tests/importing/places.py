"""A small flat to be imported, written to files of every kind with trimesh and usd-core."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import trimesh as untyped

trimesh: Any = untyped
"""Most of it has no types."""

Corner = tuple[float, float, float]
SIZE_M = (5.0, 4.0, 2.6)
WALL_M = 0.1


@dataclass(frozen=True)
class Box:
    """An axis-aligned box in metres, z up."""

    name: str
    low: Corner
    high: Corner
    color: tuple[int, int, int] = (200, 200, 200)

    @property
    def mesh(self) -> Any:
        low, high = np.array(self.low), np.array(self.high)
        mesh = trimesh.creation.box(extents=high - low)
        mesh.apply_translation((low + high) / 2)
        mesh.visual.vertex_colors = np.tile([*self.color, 255], (len(mesh.vertices), 1))
        return mesh


def flat(ceiling: bool = True, window: bool = True) -> list[Box]:
    """A furnished room of 5 x 4 m with its names as exporters write them; the floor's top is at z = 0."""
    x, y, z = SIZE_M
    w = WALL_M
    boxes = [
        Box("Floor", (-w, -w, -0.1), (x + w, y + w, 0.0), (150, 110, 70)),
        Box("Wall_N", (-w, y, 0), (x + w, y + w, z)),
        Box("Wall_S", (-w, -w, 0), (x + w, 0, z)),
        Box("Wall_W", (-w, 0, 0), (0, y, z)),
        Box("Table", (3.6, 2.6, 0.0), (4.8, 3.4, 0.74), (160, 100, 60)),
        Box("SM_Chair_01", (3.9, 2.0, 0.0), (4.35, 2.45, 0.9), (60, 90, 160)),
        Box("Bed.001", (0.05, 2.4, 0.0), (2.05, 3.9, 0.5), (220, 215, 200)),
        Box("CoffeeMug", (4.0, 2.9, 0.74), (4.08, 2.98, 0.84), (180, 40, 40)),
        Box("books", (4.4, 3.0, 0.74), (4.6, 3.25, 0.86), (40, 120, 80)),
        Box("tv stand", (0.05, 0.4, 0.0), (0.45, 1.6, 0.5), (70, 60, 50)),
        Box("TV", (0.1, 0.5, 0.5), (0.18, 1.5, 1.1), (20, 20, 20)),
        Box("UCX_Table_01", (3.5, 2.5, 0.0), (4.9, 3.5, 0.8)),
    ]
    if window:
        boxes += [
            Box("Wall_E_low", (x, 0, 0), (x + w, y, 0.9)),
            Box("Wall_E_top", (x, 0, 2.1), (x + w, y, z)),
            Box("Wall_E_1", (x, 0, 0.9), (x + w, 1.0, 2.1)),
            Box("Wall_E_2", (x, 3.0, 0.9), (x + w, y, 2.1)),
        ]
    else:
        boxes.append(Box("Wall_E", (x, 0, 0), (x + w, y, z)))
    if ceiling:
        boxes.append(Box("Ceiling", (-w, -w, z), (x + w, y + w, z + 0.1), (240, 240, 240)))
    return boxes


CLASSES = {"Table": "table", "SM_Chair_01": "chair", "Bed.001": "bed", "CoffeeMug": "cup", "books": "book", "TV": "tv"}


def moved(points: npt.NDArray[np.floating], scale: float, up: str) -> npt.NDArray[np.float64]:
    """Map-frame points in another unit and with another axis up."""
    turned = points if up == "z" else points[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
    return np.asarray(turned * scale, np.float64)


def scene(boxes: list[Box], scale: float = 1.0, up: str = "y") -> Any:
    """The boxes as trimesh has them, with vertex colours."""
    found = trimesh.Scene()
    for box in boxes:
        mesh = box.mesh
        mesh.vertices = moved(mesh.vertices, scale, up)
        found.add_geometry(mesh, node_name=box.name, geom_name=box.name)
    return found


def write(path: Path, boxes: list[Box], scale: float = 1.0, up: str = "y") -> Path:
    """Write the boxes in the format of the path's suffix, for PLY and STL as one mesh."""
    if path.suffix.startswith(".usd"):
        return write_usd(path, boxes, scale, up)
    made: Any = scene(boxes, scale, up)
    if path.suffix in (".ply", ".stl"):
        made = made.to_mesh()
    made.export(path)
    return path


def write_usd(path: Path, boxes: list[Box], scale: float = 1.0, up: str = "z") -> Path:
    """A stage with one mesh of quads for each box, which says its unit and axis."""
    from pxr import Gf, Usd, UsdGeom

    target = path.with_suffix(".usdc") if path.suffix == ".usdz" else path
    stage = Usd.Stage.CreateNew(str(target))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0 / scale)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z if up == "z" else UsdGeom.Tokens.y)
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    for box in boxes:
        name = box.name.replace(" ", "_").replace(".", "_")
        mesh = UsdGeom.Mesh.Define(stage, f"/World/{name}")
        corners = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        points = np.array(box.low) + np.array(corners) * (np.array(box.high) - np.array(box.low))
        mesh.CreatePointsAttr([Gf.Vec3f(*point) for point in moved(points, scale, up).tolist()])
        mesh.CreateFaceVertexCountsAttr([4] * 6)
        mesh.CreateFaceVertexIndicesAttr([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])
        mesh.CreateDisplayColorAttr([Gf.Vec3f(*(channel / 255 for channel in box.color))])
    stage.GetRootLayer().Save()
    if path.suffix == ".usdz":
        from pxr import UsdUtils

        assert UsdUtils.CreateNewUsdzPackage(str(target), str(path))
    return path
