"""Labels of a scan: the object that each part of its surface belongs to, and the class that its label means."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchbot.plugin import BenchbotError
from benchbot_scenes.gltf import Y_UP_TO_Z_UP
from benchbot_scenes.importing import names
from benchbot_scenes.importing.model import Model, UpAxis
from benchbot_scenes.scene import Instance
from benchbot_scenes.visibility import surface_points

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
REACH_M = 0.05
"""A scan's surface has the label of the labelled surface that is nearest, as far as this; data sets are in metres."""
SPACING_M = 0.02
SAME_M = 1e-3
LEAST_SHARE = 0.5
# What lies in a labelled box: a little more than the box, but not the floor or table top that it stands on. In halves
# of the box, since the unit of the scan is not known yet.
AROUND_SHARE, ABOVE_SHARE = 0.02, 0.04
HOLDS_SHARE = 0.8


@dataclass(frozen=True)
class OrientedBox:
    """A box that is turned: `points` (4, 3) are its middle, and the middle plus each of three half axes."""

    points: Floats

    def local(self, points: Floats) -> Floats:
        """Points (N, 3) in the box's own axes: inside, all three numbers are in -1 … 1."""
        middle, ends = self.points[0], self.points[1:]
        axes = ends - middle
        return np.asarray((points - middle) @ (axes / np.maximum((axes**2).sum(1), 1e-18)[:, None]).T)

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """The axis-aligned box around it: low and high corner."""
        reach = np.abs(self.points[1:] - self.points[0]).sum(0)
        return self.points[0] - reach, self.points[0] + reach


@dataclass(frozen=True)
class LabelledObject:
    """An object of a label file: a name that no other has, its label in the file's words, and its box if it has one."""

    name: str
    label: str
    box: OrientedBox | None = None
    is_group: bool | None = None


@dataclass(frozen=True)
class LabelledSurface:
    """Triangles (T, 3) of `vertices` (V, 3), and of each the number of its object (T,), 0 for none.

    Where `any_up`, its axes may be turned against those of the scan.
    """

    vertices: Floats
    triangles: Integers
    triangle_object: Integers
    any_up: bool = False


@dataclass(frozen=True)
class Labels:
    """The objects of a scan by files of a format; object n is `objects[n - 1]`.

    Without a `surface` their boxes say what they are made of, and are their truth.
    """

    format: str
    path: Path
    objects: tuple[LabelledObject, ...]
    surface: LabelledSurface | None


@dataclass(frozen=True)
class Labelled:
    """What labels made of a scan: the class of each label (None: no class), and how many objects have it.

    `known` are labels with a noun of the vocabulary; `boxes` are the oriented boxes of objects by name, `truths` those
    whose box is the truth as it was given, `groups` says which are said to be several.
    """

    format: str
    classes: Mapping[str, str | None]
    counts: Mapping[str, int]
    known: frozenset[str]
    boxes: Mapping[str, OrientedBox]
    truths: frozenset[str]
    groups: Mapping[str, bool]


def class_of(label: str) -> str | None:
    """The class that a label means: its last noun must be known, so that an "oven glove" is no oven."""
    found = _meaning(label)
    return None if found is None else found.class_name


def _meaning(label: str) -> names.Meaning | None:
    found = names.meaning(label)
    own = [word for word in names.words(label) if word not in names.SEVERAL]
    if found is None or not own:
        return None
    last = found.noun.split()[-1]
    return found if last in (own[-1], names.singular(own[-1])) else None


def apply(
    model: Model, labels: Labels, up: UpAxis, said: Mapping[str, str | None]
) -> tuple[Model, Labelled, dict[str, str | None]]:
    """Give each labelled object an instance of its own; return also the classes of all instances by name.

    `said` has classes of names or labels that a person knows better. What has no label has no class. Raises
    BenchbotError when the labels are of another place.
    """
    geometry = model.geometry
    objects = tuple(_moved(found, model.origin) for found in labels.objects)
    middles = geometry.vertices[geometry.triangles].mean(axis=1).astype(np.float64)
    if labels.surface is None:
        number = _in_boxes(middles, [found.box for found in objects], up)
    else:
        number = _nearest(middles, labels.surface, model.origin, labels.path)
    left = np.unique(geometry.triangle_instance[number == 0])
    used = np.unique(number[number > 0])
    renumbered = np.zeros(len(geometry.instances) + 1, np.int32)
    renumbered[left] = 1 + np.arange(len(left), dtype=np.int32)
    labelled = np.zeros(len(objects) + 1, np.int32)
    labelled[used] = 1 + len(left) + np.arange(len(used), dtype=np.int32)
    old_paths = [model.paths[index - 1] for index in left]
    taken = {path[-1] for path in old_paths}
    own = [objects[index - 1] for index in used]
    own = [replace(found, name=f"{found.name} (labelled)") if found.name in taken else found for found in own]
    paths = (*old_paths, *((found.name,) for found in own))
    split = replace(
        geometry,
        triangle_instance=np.where(number > 0, labelled[number], renumbered[geometry.triangle_instance]),
        instances=tuple(Instance(index + 1, path[-1], None) for index, path in enumerate(paths)),
    )
    classes = {found.label: said.get(found.label, class_of(found.label)) for found in own}
    # Without labels a name says what is what; with them, "living_room_table.ply" is no table.
    chosen: dict[str, str | None] = dict.fromkeys(taken)
    chosen |= {found.name: said.get(found.name, classes[found.label]) for found in own}
    notes = [*model.notes, *_notes(labels, objects, set(used.tolist()))]
    boxes = _sound_boxes(own, used, number, geometry.vertices, geometry.triangles, notes)
    result = Labelled(
        format=labels.format,
        classes=classes,
        counts=dict(Counter(found.label for found in own)),
        known=frozenset(label for label in classes if _meaning(label) is not None),
        boxes=boxes,
        truths=frozenset(found.name for found in own) if labels.surface is None else frozenset(),
        groups={found.name: found.is_group for found in own if found.is_group is not None},
    )
    return replace(model, geometry=split, paths=paths, notes=tuple(notes)), result, chosen


def _notes(labels: Labels, objects: tuple[LabelledObject, ...], used: set[int]) -> list[str]:
    missing = [found.name for number, found in enumerate(objects, start=1) if number not in used]
    if not missing:
        return []
    shown = ", ".join(missing[:5]) + (f" and {len(missing) - 5} more" if len(missing) > 5 else "")
    return [f"{len(missing)} objects of {labels.path.name} have no surface in the scan and are left out: {shown}."]


def _moved(found: LabelledObject, origin: tuple[float, float, float]) -> LabelledObject:
    return found if found.box is None else replace(found, box=OrientedBox(found.box.points - np.array(origin)))


def _sound_boxes(
    own: list[LabelledObject],
    used: Integers,
    number: Integers,
    vertices: npt.NDArray[np.float32],
    triangles: npt.NDArray[np.int32],
    notes: list[str],
) -> dict[str, OrientedBox]:
    """The oriented boxes that hold what they are of; the others are named in `notes` and left out."""
    order = np.argsort(number, kind="stable")
    starts = np.searchsorted(number[order], used)
    ends = np.searchsorted(number[order], used, side="right")
    boxes, wrong = {}, []
    for found, start, end in zip(own, starts, ends, strict=True):
        if found.box is None:
            continue
        points = vertices[np.unique(triangles[order[start:end]])].astype(np.float64)
        if (np.abs(found.box.local(points)) < 1.1).all(1).mean() < HOLDS_SHARE:
            wrong.append(found.name)
        else:
            boxes[found.name] = found.box
    if wrong:
        notes.append(f"Oriented boxes that do not hold their objects are left out: {', '.join(wrong[:5])}.")
    return boxes


def _in_boxes(points: Floats, boxes: list[OrientedBox | None], up: UpAxis) -> Integers:
    """The number of the smallest box that each point (N, 3) is in, 0 for none."""
    axis = {"y": 1, "z": 2}[up]
    number = np.zeros(len(points), np.int64)
    known = [(index, box) for index, box in enumerate(boxes, start=1) if box is not None]
    volumes = [float(np.prod(np.linalg.norm(box.points[1:] - box.points[0], axis=1))) for _, box in known]
    for place in np.argsort(volumes)[::-1]:
        index, box = known[int(place)]
        low, high = box.bounds
        around = AROUND_SHARE * (high - low)
        near = np.flatnonzero(((points > low - around) & (points < high + around)).all(1))
        local = box.local(points[near])
        inside = np.abs(local) <= 1 + AROUND_SHARE
        standing = box.points[1:, axis] - box.points[0, axis]
        upright = int(np.argmax(np.abs(standing)))
        height = 1 + np.sign(standing[upright]) * local[:, upright]
        number[near[inside.all(1) & (height > ABOVE_SHARE)]] = index
    return number


def _nearest(points: Floats, surface: LabelledSurface, origin: tuple[float, float, float], path: Path) -> Integers:
    """The number of the object whose surface is nearest to each point (N, 3), 0 for none within reach."""
    corners = surface.vertices[surface.triangles] - np.array(origin)
    turns = [np.eye(3), Y_UP_TO_Z_UP, Y_UP_TO_Z_UP.T] if surface.any_up else [np.eye(3)]
    best, share = np.zeros(len(points), np.int64), -1.0
    for turn in turns:
        found, near = _labels_near(points, corners @ turn.T, surface.triangle_object)
        if near.mean() > share:
            best, share = found, float(near.mean())
        if share > 1 - LEAST_SHARE / 2:  # it fits as it is
            break
    if share < LEAST_SHARE:
        raise BenchbotError(
            f"The labels in {path.name} do not lie on the scan",
            f"{share:.0%} of its triangles are within {REACH_M * 100:.0f} cm of what is labelled.",
            "Keep only files of one scan in a folder, or import without labels: --labels none.",
        )
    return best


def _labels_near(points: Floats, corners: Floats, owner: Integers) -> tuple[Integers, npt.NDArray[np.bool_]]:
    """The owner of the triangle (corners (T, 3, 3)) that is nearest to each point, 0 for none, and which have one."""
    from scipy.spatial import cKDTree

    middles = corners.mean(1)
    distance, place = cKDTree(middles).query(points, distance_upper_bound=SAME_M)
    near = np.isfinite(distance)
    found = np.where(near, owner[np.minimum(place, len(owner) - 1)], 0)
    left = np.flatnonzero(~near)
    if len(left):  # the scan is another mesh, or was sorted
        sides_m = np.linalg.norm(corners - np.roll(corners, -1, 1), axis=2).max(1)
        large = np.flatnonzero(sides_m > SPACING_M)
        more, triangle = surface_points(corners[large], SPACING_M)
        owners = np.concatenate([owner, owner[large][triangle]])
        distance, place = cKDTree(np.concatenate([middles, more])).query(points[left], distance_upper_bound=REACH_M)
        near[left] = np.isfinite(distance)
        found[left] = np.where(near[left], owners[np.minimum(place, len(owners) - 1)], 0)
    return found, near
