"""Brings a scene to where kernels can read it: builds or loads its tree, packs its tables, finds its windows."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot_scenes.scene import SceneGeometry
from benchbot_sim_taichi import _ti, bvh, disk_cache, lights, progress, tables, textures
from benchbot_sim_taichi.arrangement import Arrangement
from benchbot_sim_taichi.lighting import Lighting
from benchbot_sim_taichi.two_levels import Levels

TREE_VERSION = 2
TEXELS_VERSION = 1
PORTAL_RAYS = 64
PORTAL_MIN_OPEN_SHARE = 0.12  # windows to a courtyard have 0.19, a shower screen before a window 0.09
FAR_M = 1e4


def upload(scene: SceneGeometry, lighting: Lighting, cache_dir: Path) -> tables.DeviceScene:
    """Everything about a scene that does not change from frame to frame."""
    groups = tables.group_triangles(scene)
    tree = _tree(scene, groups, cache_dir)
    device_tree = (_ti.upload(tree.nodes), _ti.upload(tree.leaves))
    texels = _texels(scene, cache_dir)
    table = lights.light_table(scene, _portals(scene, groups, device_tree))
    return tables.DeviceScene(
        tree=device_tree,
        sheer_root=tree.roots[1] if len(groups.sheer) else -1,
        surfaces=(
            _ti.upload(tables.triangle_records(scene)),
            _ti.upload(tables.material_records(scene.materials)),
            _ti.upload(texels.texels),
            _ti.upload(texels.table),
        ),
        lights=(
            _ti.upload(lights.environment_record(lighting, cache_dir)),
            _ti.upload(table.records),
            table.portals,
            table.lamps,
        ),
        light_of=_ti.upload(table.of_triangle),
    )


def arrangement_of(scene: SceneGeometry, device: tables.DeviceScene) -> Arrangement:
    """The scene as it was uploaded, ready for its objects to move."""
    nodes, leaves = device.tree
    tree = bvh.Bvh(_ti.download(nodes), _ti.download(leaves), (0, device.sheer_root), _width())
    return Arrangement(scene, scene, Levels(tree))


def rearranged(
    device: tables.DeviceScene, before: Arrangement, after: Arrangement, changed: npt.NDArray[np.int64]
) -> tables.DeviceScene:
    """Bring to kernels how objects stand now; `changed` triangles are elsewhere, new or gone.

    Lamps and panes are looked for again where any of them changed.
    """
    scene = after.scene
    records, materials, texels, images = device.surfaces
    triangles = _ti.download(records)
    new = len(scene.triangles) - len(before.scene.triangles)
    if new:
        triangles = np.concatenate([triangles, np.zeros(new * tables.TRIANGLE_STRIDE, np.float32)])
        materials = _ti.upload(tables.material_records(scene.materials))
        if len(scene.images) > len(before.scene.images):
            store = textures.pack(scene.images, tables.color_images(scene.materials))
            texels, images = _ti.upload(store.texels), _ti.upload(store.table)
    rows = triangles.reshape(-1, tables.TRIANGLE_STRIDE)
    rows[changed] = tables.triangle_records(scene, changed).reshape(-1, tables.TRIANGLE_STRIDE)
    tree = after.levels.combined()
    moved = replace(
        device,
        tree=(_ti.upload(tree.nodes), _ti.upload(tree.leaves)),
        sheer_root=tree.roots[1],
        surfaces=(_ti.upload(triangles), materials, texels, images),
    )
    gives_light = np.array([m.is_glass or m.is_emissive for m in scene.materials], bool)
    if not new and not gives_light[scene.triangle_material[changed]].any():
        return moved
    return relit(moved, scene)


def relit(device: tables.DeviceScene, scene: SceneGeometry) -> tables.DeviceScene:
    """Return `device` with new tables of a scene's lamps, and of the panes that sky light enters through."""
    table = lights.light_table(scene, _portals(scene, tables.group_triangles(scene), device.tree))
    return replace(
        device,
        lights=(device.lights[0], _ti.upload(table.records), table.portals, table.lamps),
        light_of=_ti.upload(table.of_triangle),
    )


def _width() -> int:
    return bvh.NARROW if _ti.is_on_gpu() else bvh.WIDTH


def _tree(scene: SceneGeometry, groups: tables.TriangleGroups, cache_dir: Path) -> bvh.Bvh:
    path = cache_dir / f"tree-{TREE_VERSION}-{_width()}-{scene.content_hash[:32]}.npz"

    def build() -> disk_cache.Arrays:
        progress.tell(f"the simulator builds the search tree of {len(scene.triangles):,} triangles")
        tree = bvh.build(scene.vertices, scene.triangles, (groups.solid, groups.sheer), _width())
        return {"nodes": tree.nodes, "leaves": tree.leaves, "roots": np.array(tree.roots)}

    kept = disk_cache.load_or_make(path, {"nodes", "leaves", "roots"}, build)
    return bvh.Bvh(kept["nodes"], kept["leaves"], tuple(int(root) for root in kept["roots"]), _width())


def _texels(scene: SceneGeometry, cache_dir: Path) -> textures.TexelStore:
    if not scene.images:
        return textures.pack((), set())
    path = cache_dir / f"texels-{TEXELS_VERSION}-{scene.content_hash[:32]}.npz"

    def pack() -> disk_cache.Arrays:
        return asdict(textures.pack(scene.images, tables.color_images(scene.materials)))

    return textures.TexelStore(**disk_cache.load_or_make(path, {"texels", "table"}, pack))


def _portals(
    scene: SceneGeometry, groups: tables.TriangleGroups, tree: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]
) -> npt.NDArray[np.int32]:
    """Glass triangles through which the sky is seen: rays leave the scene on one side of them and not on the other."""
    from benchbot_sim_taichi.kernels import primary

    is_glass = np.array([m.is_glass for m in scene.materials], bool)
    glass = groups.sheer[is_glass[scene.triangle_material[groups.sheer]]]
    if len(glass) == 0:
        return np.zeros(0, np.int32)
    corner = scene.vertices[scene.triangles[glass]].astype(np.float64)
    oriented_area = 0.5 * np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(oriented_area, axis=1)
    is_sheet = lights.is_sheet(scene, glass, oriented_area)
    large = area > lights.PORTAL_MIN_AREA_M2
    if not large.any():
        return np.zeros(0, np.int32)
    glass, is_sheet = glass[large], is_sheet[large]
    center = corner[large].mean(axis=1)
    normal = oriented_area[large] / area[large, None]
    spread = np.random.default_rng(0).normal(size=(PORTAL_RAYS, 3))
    spread /= np.linalg.norm(spread, axis=1, keepdims=True)
    open_share = []
    for side in (normal, -normal):
        direction = spread[None] + 1.05 * side[:, None]
        direction /= np.linalg.norm(direction, axis=2, keepdims=True)
        origin = center[:, None] + 0.02 * side[:, None] + np.zeros_like(direction)
        distances = np.empty(origin.size // 3, np.float32)
        primary.cast_rays(
            *tree,
            -1,
            origin.astype(np.float32).ravel(),
            direction.astype(np.float32).ravel(),
            FAR_M,
            distances,
            len(distances),
        )
        open_share.append((distances.reshape(len(glass), PORTAL_RAYS) >= FAR_M).mean(axis=1))
    ahead, behind = open_share
    through = (behind > PORTAL_MIN_OPEN_SHARE) & (ahead < 0.5)
    through |= is_sheet & (ahead > PORTAL_MIN_OPEN_SHARE) & (behind < 0.5)
    panes: npt.NDArray[np.int32] = glass[through].astype(np.int32)
    return panes
