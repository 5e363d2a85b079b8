"""Parts of a scene as other formats take them: meshes of one object and one material, pictures and lamps."""

import io
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from PIL import Image

from benchbot_scenes.scene import ImageArray, IntArray, SceneGeometry, unit_vectors

Floats = npt.NDArray[np.float64]
LEAST_VERTICES = 4


@dataclass(frozen=True)
class Part:
    """Triangles (T, 3) of one instance and one material, by their indices."""

    instance: int
    material: int
    triangles: IntArray

    @property
    def name(self) -> str:
        """A name that no other part of the scene has."""
        return f"{self.instance}_{self.material}"


@dataclass(frozen=True)
class Lamp:
    """An emissive object: its middle and mean direction of light (map frame), and its mean radiance in linear sRGB."""

    instance: int
    position: Floats
    direction: Floats
    radiance: Floats


def parts(geometry: SceneGeometry) -> Iterator[Part]:
    """Yield every part that has triangles, by instance and material."""
    keys = np.stack([geometry.triangle_instance, geometry.triangle_material], axis=1)
    found, place = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(place.ravel(), kind="stable")
    ends = np.cumsum(np.bincount(place.ravel()))[:-1]
    for (instance, material), members in zip(found.tolist(), np.split(order, ends), strict=True):
        yield Part(instance, material, geometry.triangles[members])


def lamps(geometry: SceneGeometry) -> list[Lamp]:
    """The objects with emissive triangles, each as one lamp amid them."""
    radiance = np.array([material.emission for material in geometry.materials])[geometry.triangle_material]
    corners = geometry.vertices[geometry.triangles].astype(np.float64)
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    shines = (radiance.max(axis=1) > 0) & (area > 0)
    found = []
    for index in np.unique(geometry.triangle_instance[shines]).tolist():
        own = shines & (geometry.triangle_instance == index)
        weights = area[own, None] / area[own].sum()
        found.append(
            Lamp(
                index,
                (corners[own].mean(axis=1) * weights).sum(axis=0),
                unit_vectors(across[own].sum(axis=0)).astype(np.float64),
                (radiance[own] * weights).sum(axis=0),
            )
        )
    return found


def wavefront(geometry: SceneGeometry, part: Part, *, both_sides: bool = False) -> bytes:
    """A part as a Wavefront OBJ file in the map frame, to a micrometre; `vt` counts v from the picture's lower edge.

    With `both_sides` each triangle stands in it a second time, turned over, for what draws no backs.
    """
    used, corners = np.unique(part.triangles, return_inverse=True)
    # MuJoCo takes no mesh of three vertices.
    used = np.concatenate([used, np.repeat(used[:1], max(LEAST_VERTICES - len(used), 0))])
    uvs = geometry.uvs[used] * (1.0, -1.0) + (0.0, 1.0)
    text = io.StringIO()
    for word, rows in (("v", geometry.vertices[used]), ("vt", uvs), ("vn", geometry.normals[used])):
        np.savetxt(text, rows, f"{word}{' %.6f' * rows.shape[1]}")
    faces = np.repeat(corners.reshape(-1, 3) + 1, 3, axis=1)
    if both_sides:
        np.savetxt(text, -geometry.normals[used], "vn %.6f %.6f %.6f")
        faces = np.concatenate([faces, faces[:, ::-1] + np.tile([0, 0, len(used)], 3)])
    np.savetxt(text, faces, "f %d/%d/%d %d/%d/%d %d/%d/%d")
    return text.getvalue().encode()


def png(image: ImageArray, *, has_alpha: bool = True) -> bytes:
    """A picture as a PNG file."""
    stream = io.BytesIO()
    Image.fromarray(image if has_alpha else image[..., :3]).save(stream, "PNG", compress_level=3)
    return stream.getvalue()


def display_color(linear: npt.ArrayLike) -> Floats:
    """Linear sRGB (…, 3) as displays take it, 0 to 1 (IEC 61966-2-1)."""
    values = np.clip(np.asarray(linear, np.float64), 0.0, 1.0)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)
