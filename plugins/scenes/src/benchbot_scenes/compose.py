"""Layouts composed into scenes: one glTF 2.0 binary file of a building, what fills its openings, and all objects."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_scenes import building, catalogue, fittings
from benchbot_scenes.catalogue import AssetModel, Catalogue
from benchbot_scenes.differences import Furnished, furnished, unknown_object
from benchbot_scenes.finishes import Finishes
from benchbot_scenes.fittings import Fitting
from benchbot_scenes.floor_plan import FloorPlan, floor_plan
from benchbot_scenes.glb_writer import Change, Entry, GlbWriter, Inclusion, Matrix, MeshNode, to_file_frame
from benchbot_scenes.gltf import Y_UP_TO_Z_UP, load_scene
from benchbot_scenes.gltf_file import BROKEN, GltfFile, UnsupportedError, split_glb
from benchbot_scenes.layout import Layout, Move
from benchbot_scenes.looks import Looks
from benchbot_scenes.placing import Placed, moved, place, turned
from benchbot_scenes.variations import SurfaceFinish

MOUNTED = ("wall", "ceiling", "opening")
"""Placements that need nothing below them."""

_FINISHES_OF = "household"
"""The pack whose finishes serve those that have none."""


@dataclass(frozen=True)
class Recipe:
    """All that a composed scene is made of."""

    furnished: Furnished
    plan: FloorPlan | None
    finishes: Path | None
    fittings: tuple[Fitting, ...]
    objects: tuple[Placed, ...]

    def files(self) -> list[Path]:
        """The files that it is made from, each once, sorted."""
        models = [*(fitting.model for fitting in self.fittings), *(placed.model for placed in self.objects)]
        looks = {model.looks for model in models if model.finish}
        others = {path for path in (self.furnished.finished, self.finishes, *looks) if path is not None}
        return sorted({model.file for model in models} | others)


def compose(layout: Layout, catalogues: Mapping[str, Catalogue] | None = None, assets: str | None = None) -> bytes:
    """The scene of a layout as a GLB file; always the same bytes for the same layout and models.

    `catalogues` are asset packs by name, which come before those that are installed. `assets` names a pack whose models
    stand in for the objects that have a class. Raises BenchbotError for a layout that cannot be.
    """
    return cook(recipe(layout, catalogues, assets))


def recipe(layout: Layout, catalogues: Mapping[str, Catalogue] | None = None, assets: str | None = None) -> Recipe:
    """The parts of a layout's scene, every difference applied and every model chosen."""
    scene = furnished(layout)

    def pack(name: str) -> Catalogue:
        return catalogues[name] if catalogues and name in catalogues else catalogue.pack(name)

    other = None if assets is None else pack(assets)
    objects = tuple(
        place(placement, pack(name).model(placement.model), None if name == assets else other)
        for name, placement in scene.objects
    )
    if scene.building is None:
        return Recipe(scene, None, None, (), objects)
    plan = floor_plan(scene.building)
    own = pack(scene.assets)
    finishes = own.finishes or pack(_FINISHES_OF).finishes
    filled = (fittings.fitting(passage, own) for passage in plan.passages)
    return Recipe(scene, plan, finishes, tuple(piece for piece in filled if piece is not None), objects)


def cook(made_of: Recipe) -> bytes:
    """Write a recipe's scene."""
    writer = GlbWriter()
    models = _Models(writer)
    scene = made_of.furnished
    if scene.finished is not None:
        _add_finished(writer, scene.finished, scene, {placed.name for placed in made_of.objects})
    if scene.building is not None and made_of.plan is not None:
        finishes = Finishes(writer, made_of.finishes)
        for piece in building.pieces(scene.building, made_of.plan):
            parts = [finishes.finish(name).on(mesh) for mesh, name in piece.parts]
            writer.node(piece.name, writer.mesh(parts), _tag(piece.name, None, is_group=False, is_mounted=False))
    for filling in made_of.fittings:
        tag = _tag(filling.name, None, is_group=False, is_mounted=True)
        models.add(filling.model, filling.matrix, tag, filling.open_deg)
    for placed in made_of.objects:
        is_mounted = placed.model.placement in MOUNTED
        tag = _tag(placed.name, placed.class_name, is_group=placed.is_group, is_mounted=is_mounted)
        models.add(placed.model, placed.matrix, tag)
    return writer.to_bytes()


class _Models:
    """The models in the file being written; each file is taken over once, whatever its variations are finished with."""

    def __init__(self, writer: GlbWriter) -> None:
        self._writer = writer
        self._files: dict[Path, tuple[GltfFile, Inclusion]] = {}
        self._looks: dict[Path, Looks] = {}
        self._nodes: dict[tuple[Path, tuple[SurfaceFinish | None, ...]], list[MeshNode]] = {}

    def add(self, model: AssetModel, matrix: Matrix, tag: dict[str, Any], open_deg: float = 0.0) -> None:
        """Put a model into the scene, a door's leaf open by `open_deg`."""
        for node in self._taken_over(model):
            turn = np.eye(4)
            if open_deg and fittings.LEAF in node.path:
                turn = fittings.opened(open_deg, self._points(model.file, node))
            self._writer.node(tag["instance"], node.mesh, tag, to_file_frame(matrix @ turn) @ node.matrix)

    def _taken_over(self, model: AssetModel) -> list[MeshNode]:
        key = model.file, model.finish
        if key not in self._nodes:
            with _reading(model.file):
                if model.file not in self._files:
                    document, binary = _read(model.file)
                    file = GltfFile(document, binary)
                    self._files[model.file] = file, self._writer.inclusion(document, binary)
                self._nodes[key] = self._files[model.file][1].nodes(self._change(model))
        return self._nodes[key]

    def _change(self, model: AssetModel) -> Change | None:
        if model.looks is None or not any(model.finish):
            return None
        looks = self._looks.setdefault(model.looks, Looks(self._writer, model.looks))

        def change(number: int, entry: Entry, take: Callable[[Entry], Entry]) -> Entry | None:
            finish = model.finish[number]
            return None if finish is None else looks.finished(entry, finish, take)

        return change

    def _points(self, path: Path, node: MeshNode) -> Matrix:
        """A node's vertices (N, 3) in the model's frame (z up)."""
        file, _ = self._files[path]
        mesh = file.document["meshes"][node.entry["mesh"]]
        points = np.concatenate([file.accessor(part["attributes"]["POSITION"]) for part in mesh["primitives"]])
        return np.asarray((points @ node.matrix[:3, :3].T + node.matrix[:3, 3]) @ Y_UP_TO_Z_UP.T)


def _add_finished(writer: GlbWriter, path: Path, scene: Furnished, added: set[str]) -> None:
    """The nodes of a finished scene, less what is removed, with what is moved where it goes."""
    with _reading(path):
        nodes = writer.include(*_read(path))
    names = {node.name for node in nodes}
    for name in (*sorted(scene.removed), *(move.id for move in scene.moved)):
        if name not in names:
            raise unknown_object(name, sorted(names))
    for name in sorted(added & (names - scene.removed)):
        raise BenchbotError(
            f"A layout adds '{name}', but its base has an object of that name.",
            f"The scene file {path} has {len(names)} objects.",
            "Give the added object another id, or remove that of the base.",
        )
    moves = _movements(path, scene.moved)
    for node in nodes:
        if node.name not in scene.removed:
            matrix = to_file_frame(moves[node.name]) @ node.matrix if node.name in moves else node.matrix
            writer.node(node.name, node.mesh, node.tag, matrix)


def _movements(path: Path, moves: tuple[Move, ...]) -> dict[str, Matrix]:
    """The transforms, in the map frame, that take objects of a scene file where they are moved."""
    if not moves:
        return {}
    geometry = load_scene(path)
    found = {}
    for move in moves:
        indices = [instance.index for instance in geometry.instances if instance.name == move.id]
        corners = geometry.vertices[geometry.triangles[np.isin(geometry.triangle_instance, indices)]].reshape(-1, 3)
        low, high = corners.min(axis=0).astype(float), corners.max(axis=0).astype(float)
        foot = (-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2])
        found[move.id] = moved(move.position) @ turned(move.turn_deg) @ moved(foot)
    return found


def _tag(name: str, class_name: str | None, *, is_group: bool, is_mounted: bool) -> dict[str, Any]:
    tag: dict[str, Any] = {"class": class_name, "instance": name, "group": is_group}
    return {**tag, "mounted": True} if is_mounted else tag


def _read(path: Path) -> tuple[dict[str, Any], bytes]:
    with _reading(path):
        return split_glb(path.read_bytes())


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Names the file in errors of reading it."""
    try:
        yield
    except FileNotFoundError as error:
        raise BenchbotError(
            f"There is no scene file {path}",
            "A layout, or an asset pack's catalogue, names it.",
            "Correct the layout's base, or install the asset pack again.",
        ) from error
    except (UnsupportedError, *BROKEN) as error:
        raise BenchbotError(
            f"The scene file {path} cannot be used in a layout.",
            f"{type(error).__name__}: {error}",
            "Export it again as binary glTF 2.0 that holds everything itself.",
        ) from error
