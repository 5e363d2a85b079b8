"""Grouping of meshes into objects, by their names and those of their parent nodes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchbot.plugin import BenchbotError
from benchbot_scenes.importing import names
from benchbot_scenes.scene import Instance, SceneGeometry, only


@dataclass(frozen=True)
class Found:
    """An object: its name in the scene, its class if it has one, whether it is several in one, its instances, and the
    names that lead to it.
    """

    name: str
    class_name: str | None
    is_group: bool
    instances: tuple[int, ...]
    path: tuple[str, ...]


@dataclass(frozen=True)
class Recognised:
    """The objects of a file, the names of its meshes that are for physics only, and nouns that it does not know."""

    objects: tuple[Found, ...]
    colliders: tuple[str, ...]


def recognise(
    paths: Sequence[tuple[str, ...]],
    instances: Sequence[Instance],
    said: Mapping[str, str | None],
    hidden: Sequence[str] | None,
) -> Recognised:
    """Sort the meshes of a file into objects by the names on their `paths`.

    The last name on a path that says what a thing is counts: the cup that hangs on a table is a cup, a leg that hangs
    on a chair is part of the chair, and all that hangs on a name that stands for one thing is that one thing.
    Classes that a finished scene gives in its extras (`instances`) stay.
    `said` gives the classes of names that a person knows better (None: no class); `hidden` names the colliders,
    None: those that look like it.
    """
    colliders = [_is_hidden(path, hidden) for path in paths]
    groups: dict[tuple[tuple[str, ...], str | None, bool], list[int]] = {}
    for index, path in enumerate(paths):
        if not colliders[index]:
            groups.setdefault(_claim(path, instances[index], said), []).append(index + 1)
    taken: dict[str, int] = {}
    objects = []
    for (path, class_name, is_group), members in groups.items():
        name = path[-1]
        taken[name] = taken.get(name, 0) + 1
        unique = name if taken[name] == 1 else f"{name} {taken[name]}"
        objects.append(Found(unique, class_name, is_group, tuple(members), path))
    hidden_names = tuple(path[-1] for path, is_hidden in zip(paths, colliders, strict=True) if is_hidden)
    return Recognised(tuple(objects), hidden_names)


def _is_hidden(path: tuple[str, ...], hidden: Sequence[str] | None) -> bool:
    return any(names.is_collider(step) for step in path) if hidden is None else not set(hidden).isdisjoint(path)


def _claim(
    path: tuple[str, ...], given: Instance, said: Mapping[str, str | None]
) -> tuple[tuple[str, ...], str | None, bool]:
    """Up to where on its path the object goes that a mesh belongs to, its class, and whether it is several."""
    if given.class_name is not None:
        return (*path, given.name), said.get(given.name, given.class_name), given.is_group
    claimed: tuple[tuple[str, ...], str | None, bool] | None = None
    for depth in range(len(path), 0, -1):
        step = path[depth - 1]
        found = names.meaning(step)
        if step in said:
            return path[:depth], said[step], found is not None and found.is_plural
        if found is None or found.class_name is None:
            continue
        if claimed is None:
            claimed = (path[:depth], found.class_name, found.is_plural)
        elif found.class_name == claimed[1] and not found.is_plural:
            claimed = (path[:depth], found.class_name, False)
        else:
            break
    return claimed or (path, None, False)


def sorted_into(geometry: SceneGeometry, recognised: Recognised) -> SceneGeometry:
    """The scene with one instance for each object, without colliders; raises BenchbotError when nothing is left."""
    number = np.zeros(max(found.index for found in geometry.instances) + 1, np.int32)
    for index, found in enumerate(recognised.objects, start=1):
        number[list(found.instances)] = index
    is_kept = number[geometry.triangle_instance] > 0
    if not is_kept.any():
        raise BenchbotError(
            "The scene holds nothing to be seen",
            f"All its meshes are named like colliders: {', '.join(recognised.colliders[:5])}.",
            "Name those that are to be hidden yourself: a list 'hidden' in the file of --guesses; [] hides none.",
        )
    left = geometry if is_kept.all() else only(geometry, is_kept)
    return replace(
        left,
        triangle_instance=number[left.triangle_instance],
        instances=tuple(
            Instance(index, found.name, found.class_name, found.is_group)
            for index, found in enumerate(recognised.objects, start=1)
        ),
    )
