"""Wavefront OBJ with its materials (MTL), as Blender, SketchUp, MeshLab and scanning apps write them.

After "Object Files (.obj)" and "Material Library File (.mtl)" of Wavefront's Advanced Visualizer manual; colours of
vertices after their coordinates are what scanning programs added.
"""

from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import files, mtl
from benchbot_scenes.importing.model import Model, Part, assemble
from benchbot_scenes.importing.polygons import triangulate
from benchbot_scenes.vertex_colors import srgb_to_linear

Group = tuple[tuple[str, ...], str]
Shape = tuple[int, int, bool]


@dataclass
class _Lines:
    """The file sorted by what its lines are: faces by object, material and form."""

    points: list[str] = field(default_factory=list)
    textures: list[str] = field(default_factory=list)
    normals: list[str] = field(default_factory=list)
    faces: dict[Group, dict[Shape, list[str]]] = field(default_factory=lambda: defaultdict(lambda: defaultdict(list)))
    libraries: list[str] = field(default_factory=list)


def read(path: Path) -> Model:
    """Read an OBJ file; neither unit nor up axis are known of one."""
    folder = files.Folder(path)
    data = path.read_bytes()
    lines = _sorted(data.decode("utf-8", errors="replace"))
    if not lines.points or not lines.faces:
        raise BenchbotError(
            f"{path.name} holds no triangles",
            f"It has {len(lines.points)} points and no faces between them.",
            "Export it again with its faces; of a point cloud make a mesh first.",
        )
    try:
        points, normals = _numbers(lines.points), _numbers(lines.normals)[:, :3]
        textures = _numbers(lines.textures)
        library = mtl.read(lines.libraries, folder)
        parts = [
            part
            for (names, material), shapes in lines.faces.items()
            for shape, faces in shapes.items()
            for number in [library.index(material)]
            for part in [_part(names, number, library.is_textured(number), shape, faces, points, textures, normals)]
            if len(part.triangles)
        ]
        model = assemble(parts, library.materials, library.images, notes=library.notes)
    except (ValueError, IndexError, OverflowError) as error:
        raise BenchbotError(
            f"{path.name} is not a valid OBJ file",
            str(error),
            "Export it again, or fetch it again if it was cut short.",
        ) from error
    if data[-1:] not in b"\r\n":
        model = replace(model, notes=(*model.notes, "Its last line has no end: it may have been cut short."))
    missing = [f"The texture {name} is not there; a plain colour stands for it." for name in folder.missing]
    return replace(model, notes=(*model.notes, *missing))


def _sorted(text: str) -> _Lines:
    lines = _Lines()
    name, group, material = "", "", ""
    for line in text.replace("\\\n", " ").splitlines():
        keyword, _, rest = line.strip().partition(" ")
        match keyword:
            case "v":
                lines.points.append(rest)
            case "vt":
                lines.textures.append(rest)
            case "vn":
                lines.normals.append(rest)
            case "f":
                if "-" in rest:
                    rest = _counted_from_the_start(rest, lines)
                if rest.endswith("/") or "/ " in rest:
                    rest = " ".join(corner.rstrip("/") for corner in rest.split())
                form = (len(rest.split()), rest.count("/"), "//" in rest)
                lines.faces[(name, group), material][form].append(rest)
            case "o":
                name, group = rest.strip(), ""
            case "g":
                group = rest.strip()
            case "usemtl":
                material = rest.strip()
            case "mtllib":
                lines.libraries.append(rest.strip())
    return lines


def _counted_from_the_start(face: str, lines: _Lines) -> str:
    counts = (len(lines.points), len(lines.textures), len(lines.normals))

    def absolute(corner: str) -> str:
        numbers = zip(corner.split("/"), counts, strict=False)
        return "/".join(str(count + 1 + int(text)) if text.startswith("-") else text for text, count in numbers)

    return " ".join(absolute(corner) for corner in face.split())


def _numbers(lines: list[str]) -> npt.NDArray[np.float64]:
    """(N, K) numbers of lines, K those of the first line; what a later line lacks is 0."""
    if not lines:
        return np.zeros((0, 3))
    width = len(lines[0].split())
    if all(line.count(" ") == width - 1 for line in lines):
        values = np.array(" ".join(lines).split(), np.float64)
        if values.size == len(lines) * width:
            return values.reshape(-1, width)
    rows = (line.split()[:width] for line in lines)
    return np.array([[*map(float, row), *[0.0] * (width - len(row))] for row in rows])


def _part(
    names: tuple[str, ...],
    material: int,
    is_textured: bool,
    shape: Shape,
    faces: list[str],
    points: npt.NDArray[np.float64],
    textures: npt.NDArray[np.float64],
    normals: npt.NDArray[np.float64],
) -> Part:
    corner_count, slashes, has_gap = shape
    if corner_count < 3:
        return Part(names, points[:0, :3], np.zeros((0, 3), np.int64), material)
    per_corner = 1 if slashes == 0 else 2 if has_gap or slashes == corner_count else 3
    numbers = np.array(" ".join(faces).replace("/", " ").split(), np.int64)
    if numbers.size != len(faces) * corner_count * per_corner:
        raise ValueError(f"a face cannot be read, one of: f {faces[0]}")
    corners = numbers.reshape(-1, per_corner) - 1
    columns = {"points": 0} | ({"textures": 1} if per_corner > 1 and not has_gap else {})
    columns |= {"normals": per_corner - 1} if has_gap or per_corner == 3 else {}
    for name, rows in (("points", points), ("textures", textures), ("normals", normals)):
        column = corners[:, columns[name]] if name in columns else corners[:0, 0]
        if len(column) and (column.min() < 0 or column.max() >= len(rows)):
            if name == "points":
                raise ValueError("a face names one of the points that is not there")
            columns.pop(name)  # some exporters miscount what they do not need
    places = triangulate(corners[:, 0].reshape(-1, corner_count), points[:, :3])
    is_painted = points.shape[1] in (6, 7) and not is_textured
    # Corners that agree in all that they name are one vertex.
    rows, vertex = np.unique(corners, axis=0, return_inverse=True)
    colors = points[rows[:, 0], -3:] if is_painted else None
    return Part(
        path=names,
        vertices=points[rows[:, 0], :3],
        triangles=vertex.reshape(-1)[places],
        material=mtl.PAINTED_NUMBER if is_painted else material,
        normals=normals[rows[:, columns["normals"]]] if "normals" in columns else None,
        uvs=textures[rows[:, 1], :2] * [1.0, -1.0] + [0.0, 1.0] if "textures" in columns else None,
        colors=None if colors is None else srgb_to_linear(colors),
    )
