"""Layouts on layouts: what stands in a scene once every difference to its base is applied."""

from dataclasses import dataclass, replace
from pathlib import Path

from benchbot.plugin import BenchbotError, did_you_mean
from benchbot_scenes.layout import Building, Layout, Move, Placement, read_layout

LAYOUT_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True)
class Furnished:
    """A layout without a base: `building`, or else `finished`, a scene file that is taken as it is but for the objects
    that are `removed` and `moved`. `objects` are added, each with the name of the pack that its model is from.
    """

    assets: str
    building: Building | None
    finished: Path | None
    objects: tuple[tuple[str, Placement], ...]
    removed: frozenset[str] = frozenset()
    moved: tuple[Move, ...] = ()


def furnished(layout: Layout) -> Furnished:
    """Apply a layout's differences to its base, and those of the base to its own; raises BenchbotError when they do not
    fit, but for names of a finished scene, which only reading it can tell.
    """
    return _furnished(layout, ())


def _furnished(layout: Layout, above: tuple[Path, ...]) -> Furnished:
    if layout.base is None:
        start = Furnished(layout.assets, layout.building, None, ())
    elif layout.base.suffix.lower() in LAYOUT_SUFFIXES:
        path = layout.base.resolve()
        if path in above:
            raise BenchbotError(
                f"The layout {path} is a difference to itself.",
                f"Its bases lead back to it: {' → '.join(base.name for base in (*above, path))}.",
                "Let one of them have a building, or a scene file, as its start.",
            )
        start = _furnished(read_layout(path), (*above, path))
    else:
        start = Furnished(layout.assets, None, layout.base, ())
    return _changed(start, layout)


def _changed(start: Furnished, layout: Layout) -> Furnished:
    """The scene after a layout's own differences: first it removes, then it moves, then it adds."""
    objects = {placement.id: (assets, placement) for assets, placement in start.objects}
    removed, moved = set(start.removed), {move.id: move for move in start.moved}
    for name in layout.removed:
        _require(name, objects, start, removed)
        if objects.pop(name, None) is None:
            removed.add(name)
            moved.pop(name, None)
    for move in layout.moved:
        _require(move.id, objects, start, removed)
        if move.id in objects:
            assets, placement = objects[move.id]
            turned = (placement.yaw_deg + move.turn_deg) % 360.0
            objects[move.id] = (assets, replace(placement, position=move.position, yaw_deg=turned))
        else:
            before = moved.get(move.id, move)
            turn = move.turn_deg if before is move else before.turn_deg + move.turn_deg
            moved[move.id] = replace(move, turn_deg=turn)
    for placement in layout.objects:
        if placement.id in objects:
            raise BenchbotError(
                f"Two objects of a layout are named '{placement.id}'.",
                "An object's id is how maps, ground truths and other layouts know it.",
                "Give each object, those of the base included, an id of its own.",
            )
        objects[placement.id] = (layout.assets, placement)
    return replace(
        start,
        assets=layout.assets,
        objects=tuple(objects.values()),
        removed=frozenset(removed),
        moved=tuple(moved.values()),
    )


def _require(name: str, objects: dict[str, tuple[str, Placement]], start: Furnished, removed: set[str]) -> None:
    if name not in objects and (start.finished is None or name in removed):
        raise unknown_object(name, list(objects))


def unknown_object(name: str, known: list[str]) -> BenchbotError:
    """The error of a difference that names an object which the base does not have."""
    return BenchbotError(
        f"A layout changes '{name}', which its base does not have.",
        f"The base has {len(known)} objects.{did_you_mean(name, known)}",
        "Name an object of the base by its id (in a scene file: an instance's name).",
    )
