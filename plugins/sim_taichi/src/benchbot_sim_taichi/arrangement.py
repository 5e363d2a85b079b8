"""The arrangement of a scene's objects: they move, come and go without a rebuild of the others' trees."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.scene import IntArray, Material, SceneGeometry
from benchbot_sim_taichi import bvh, tables
from benchbot_sim_taichi.two_levels import Levels, refitted

FARTHEST_M = 1e5


@dataclass(frozen=True)
class Arrangement:
    """`scene` as it stands, `origin` with every object where it first was.

    `levels` are its trees. Triangles keep their ids: those of an object that is taken away lose their area.
    """

    scene: SceneGeometry
    origin: SceneGeometry
    levels: Levels

    def has_moved(self, instance: int) -> bool:
        """Return whether an object has trees of its own."""
        return instance in self.levels.parts

    def triangles_of(self, instance: int) -> npt.NDArray[np.int64]:
        """Return the ids of an object's triangles; raise BenchbotError if there is no such object."""
        there = [known.index for known in self.scene.instances]
        if instance not in there:
            listed = ", ".join(str(index) for index in there[:20]) + (", …" if len(there) > 20 else "")
            raise BenchbotError(
                f"There is no object {instance} in this scene",
                f"Its objects are numbered: {listed or 'none'}.",
                "Take one of them: an instance's `index`, the value that it has in instance images.",
            )
        return np.flatnonzero(self.scene.triangle_instance == instance)


def move(arrangement: Arrangement, instance: int, transform: npt.NDArray[np.floating]) -> Arrangement:
    """Put an object where the rigid `transform` (4, 4) takes it from where it first was."""
    matrix = _rigid(transform)
    lifted = _lifted(arrangement, instance)
    triangles = lifted.triangles_of(instance)
    used = np.unique(lifted.scene.triangles[triangles])
    vertices, normals = lifted.scene.vertices.copy(), lifted.scene.normals.copy()
    origin = lifted.origin
    vertices[used] = origin.vertices[used].astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    normals[used] = origin.normals[used].astype(np.float64) @ matrix[:3, :3].T
    scene = replace(lifted.scene, vertices=vertices, normals=normals)
    tree = refitted(lifted.levels.parts[instance], scene.vertices, scene.triangles)
    return replace(lifted, scene=scene, levels=lifted.levels.with_part(instance, tree))


def remove(arrangement: Arrangement, instance: int) -> Arrangement:
    """Take an object away."""
    gone = np.zeros(len(arrangement.scene.triangles), bool)
    gone[arrangement.triangles_of(instance)] = True
    levels = arrangement.levels
    return Arrangement(
        _without(arrangement.scene, instance, gone),
        _without(arrangement.origin, instance, gone),
        levels.without_part(instance) if arrangement.has_moved(instance) else levels.without(gone),
    )


def add(
    arrangement: Arrangement, mesh: SceneGeometry, transform: npt.NDArray[np.floating]
) -> tuple[Arrangement, tuple[int, ...]]:
    """Put all objects of another scene into this one; also returns their new numbers, in the order of its instances."""
    taken = max((known.index for known in arrangement.scene.instances), default=0)
    offset = max(taken, int(arrangement.scene.triangle_instance.max(initial=0)))
    numbers = tuple(known.index + offset for known in mesh.instances)
    joined = replace(
        arrangement,
        scene=_joined(arrangement.scene, mesh, offset),
        origin=_joined(arrangement.origin, mesh, offset),
    )
    for number in numbers:
        joined = replace(joined, levels=_with_own_tree(joined.levels, joined.scene, number))
        joined = move(joined, number, transform)
    return joined, numbers


def _lifted(arrangement: Arrangement, instance: int) -> Arrangement:
    """The object on trees and on vertices of its own."""
    if arrangement.has_moved(instance):
        return arrangement
    is_its = np.zeros(len(arrangement.scene.triangles), bool)
    is_its[arrangement.triangles_of(instance)] = True
    scene, origin = arrangement.scene, arrangement.origin
    shared = np.intersect1d(scene.triangles[is_its], scene.triangles[~is_its])
    if len(shared):
        scene, origin = _split(scene, shared, is_its), _split(origin, shared, is_its)
    return Arrangement(scene, origin, _with_own_tree(arrangement.levels.without(is_its), scene, instance))


def _with_own_tree(levels: Levels, scene: SceneGeometry, instance: int) -> Levels:
    triangles = np.flatnonzero(scene.triangle_instance == instance)
    is_sheer = tables.is_sheer(scene)[triangles]
    groups = (triangles[~is_sheer], triangles[is_sheer])
    return levels.with_part(instance, bvh.build(scene.vertices, scene.triangles, groups, levels.static.width))


def _split(scene: SceneGeometry, shared: IntArray, is_its: npt.NDArray[np.bool_]) -> SceneGeometry:
    """Copies of shared vertices, for the triangles that `is_its` marks."""
    renamed = np.arange(len(scene.vertices), dtype=np.int32)
    renamed[shared] = len(scene.vertices) + np.arange(len(shared), dtype=np.int32)
    triangles = scene.triangles.copy()
    triangles[is_its] = renamed[triangles[is_its]]
    return replace(
        scene,
        vertices=np.concatenate([scene.vertices, scene.vertices[shared]]),
        normals=np.concatenate([scene.normals, scene.normals[shared]]),
        uvs=np.concatenate([scene.uvs, scene.uvs[shared]]),
        triangles=triangles,
    )


def _without(scene: SceneGeometry, instance: int, gone: npt.NDArray[np.bool_]) -> SceneGeometry:
    triangles = scene.triangles.copy()
    triangles[gone] = 0
    return replace(
        scene,
        triangles=triangles,
        triangle_instance=np.where(gone, 0, scene.triangle_instance).astype(np.int32),
        instances=tuple(known for known in scene.instances if known.index != instance),
    )


def _joined(scene: SceneGeometry, mesh: SceneGeometry, instance_offset: int) -> SceneGeometry:
    images = len(scene.images)
    return SceneGeometry(
        vertices=np.concatenate([scene.vertices, mesh.vertices]),
        triangles=np.concatenate([scene.triangles, mesh.triangles + np.int32(len(scene.vertices))]),
        triangle_instance=np.concatenate([scene.triangle_instance, mesh.triangle_instance + np.int32(instance_offset)]),
        triangle_material=np.concatenate(
            [scene.triangle_material, mesh.triangle_material + np.int32(len(scene.materials))]
        ),
        normals=np.concatenate([scene.normals, mesh.normals]),
        uvs=np.concatenate([scene.uvs, mesh.uvs]),
        materials=(*scene.materials, *(_with_images_after(images, material) for material in mesh.materials)),
        instances=(
            *scene.instances,
            *(replace(known, index=known.index + instance_offset) for known in mesh.instances),
        ),
        images=(*scene.images, *mesh.images),
        splats=scene.splats,
    )


def _with_images_after(images: int, material: Material) -> Material:
    kinds = ("base_color_image", "metallic_roughness_image", "normal_image", "emission_image")
    shifted = {kind: getattr(material, kind) for kind in kinds if getattr(material, kind) is not None}
    return replace(material, **{kind: image + images for kind, image in shifted.items()})


def _rigid(transform: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    matrix = np.asarray(transform, np.float64)
    if matrix.shape == (4, 4) and np.isfinite(matrix).all() and np.abs(matrix).max() < FARTHEST_M:
        rotation = matrix[:3, :3]
        is_rotation = np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) and np.linalg.det(rotation) > 0
        if is_rotation and np.array_equal(matrix[3], [0, 0, 0, 1]):
            return matrix
    raise BenchbotError(
        "This is no pose to put an object at",
        "An object is turned and shifted, neither scaled nor mirrored, and stays within 100 km.",
        "Give a (4, 4) matrix such as Pose((x, y, z), (qx, qy, qz, qw)).matrix().",
    )
