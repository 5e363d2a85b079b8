"""People."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tools.household import materials
from tools.household.item import Item
from tools.household.model import Material, Model, Part, bounds, fit_to_box
from tools.household.people import Looks, person
from tools.household.poses import ARMS_CROSSED, PHONING, SITTING, SITTING_BACK, STANDING, WALKING, Pose
from tools.household.textures import linear_color

# So often points are moved, since one way disturbs another.
_ROUNDS = 12


def _cloth(name: str, code: str) -> Material:
    """Plain cloth: what lies in folds needs no weave."""
    return Material(name, linear_color(code), roughness=0.9)


_MAN = Looks(
    1.02,
    False,
    "#c68e6f",
    "#2f231b",
    False,
    materials.knit("pullover", "#5d6f7c"),
    _cloth("jeans", "#3d5170"),
    "#5a4332",
)
_WOMAN = Looks(
    0.96,
    True,
    "#d9a787",
    "#6b4528",
    True,
    materials.linen("blouse", "#b86a55"),
    _cloth("skirt", "#3f4a44"),
    "#2a2526",
    skirt=True,
    eyes="#5a6b4a",
)
_SEATED = Looks(
    0.98,
    True,
    "#7b5139",
    "#1d1714",
    False,
    materials.linen("shirt", "#d6cfb9"),
    _cloth("trousers", "#4a4a50"),
    "#e6e2da",
)

_SITTING_MAN = Looks(
    1.0,
    False,
    "#b27a58",
    "#4a3a30",
    False,
    materials.knit("pullover", "#8a4b3c"),
    _cloth("trousers", "#6d6655"),
    "#2d2d30",
)
_WALKING_MAN = Looks(
    1.01,
    False,
    "#8a5a3e",
    "#17120f",
    False,
    materials.linen("shirt", "#8fa3ad"),
    _cloth("trousers", "#3a3f48"),
    "#3b2a20",
)
_PHONING_WOMAN = Looks(
    0.95,
    True,
    "#e2b496",
    "#2b1d16",
    True,
    materials.knit("pullover", "#d0b98c"),
    _cloth("jeans", "#34445e"),
    "#d8d4cc",
    eyes="#3c5a6b",
)
_CROSSING_MAN = Looks(
    1.03,
    False,
    "#d9a787",
    "#7a6a58",
    False,
    materials.linen("shirt", "#e1e3e2"),
    _cloth("trousers", "#54493c"),
    "#4a3526",
    eyes="#55707f",
)


# The outermost points of the models of published layouts seen from above, in metres: by the angle (degrees) at which
# one stands there, those furthest along x, y, -x and -y of the map.
_MAN_ENDS = {
    0.0: ((0.16763, -0.13665), (-0.07150, 0.30043), (-0.16763, -0.01190), (-0.06064, -0.30043)),
    9.5: ((0.16763, -0.13665), (0.02320, 0.28674), (-0.16330, 0.04847), (-0.07137, -0.29984)),
    52.0: ((0.07732, -0.26713), (0.08981, 0.25406), (-0.10212, 0.28807), (-0.10388, -0.28460)),
    55.8: ((0.07732, -0.26713), (0.16058, 0.16031), (-0.10212, 0.28807), (-0.11744, -0.26588)),
    205.1: ((-0.11679, 0.27101), (-0.07137, -0.29984), (0.16324, -0.15276), (0.06800, 0.27403)),
}
_WOMAN_ENDS = {
    0.0: ((0.21921, 0.04914), (-0.03125, 0.27868), (-0.21921, -0.01743), (0.04153, -0.27868)),
    67.2: ((0.10012, -0.25586), (0.18727, 0.15177), (-0.07833, 0.26641), (-0.21691, -0.05804)),
    127.5: ((-0.13020, -0.22516), (0.12059, -0.23758), (0.10912, 0.25317), (-0.19411, 0.13935)),
}


def _ending(model: Model, points: Mapping[float, tuple[float, float]]) -> Model:
    """A model of the same box that, seen from above, ends at these points (x, y) at these angles in degrees.

    They are from the middle of the box. What reaches further is pressed flat, and what is nearest pulled there; by
    millimetres, or it would show.
    """
    low, high = bounds(model)
    middle = (low[:2] + high[:2]) / 2
    vertices = np.concatenate([part.mesh.vertices for part in model])
    seen = vertices[:, :2] - middle
    ways = [(np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))]), end) for angle, end in points.items()]
    for _ in range(_ROUNDS):
        for way, end in ways:
            seen += np.minimum(way @ end - seen @ way, 0.0)[:, None] * way
    free = np.ones(len(seen), bool)
    for end in dict.fromkeys(points.values()):
        nearest = vertices[np.argmin(np.linalg.norm(seen - end, axis=1) + ~free)]
        moved_there = np.linalg.norm(vertices - nearest, axis=1) < 1e-6
        seen[moved_there], free[moved_there] = end, False
    vertices[:, :2] = seen + middle
    meshes = np.split(vertices, np.cumsum([len(part.mesh.vertices) for part in model])[:-1])
    return tuple(
        Part(replace(part.mesh, vertices=mesh), part.material) for part, mesh in zip(model, meshes, strict=True)
    )


def _published(
    pose: Pose,
    looks: Looks,
    size_m: tuple[float, float, float],
    ends: Mapping[float, Sequence[tuple[float, float]]] | None = None,
) -> Model:
    """A person in the box that published layouts rely on, upright and at the angles of `ends`."""
    model = fit_to_box(person(pose, looks), size_m, may_turn=False)
    turned = ends or {}
    return _ending(model, {quarter * 90.0 - yaw: row[quarter] for yaw, row in turned.items() for quarter in range(4)})


ITEMS = (
    Item(
        "person_man_standing",
        "person",
        lambda: _published(STANDING, _MAN, (0.3353, 0.6009, 1.7803), _MAN_ENDS),
        "person",
        "floor",
        texture_px=128,
    ),
    Item(
        "person_woman_standing",
        "person",
        lambda: _published(STANDING, _WOMAN, (0.4384, 0.5574, 1.6747), _WOMAN_ENDS),
        "person",
        "floor",
        texture_px=128,
    ),
    Item(
        "person_woman_sitting",
        "sitting person",
        lambda: _published(SITTING, _SEATED, (0.7554, 0.5933, 1.3088)),
        "person",
        "floor",
        texture_px=128,
    ),
    Item(
        "person_man_sitting",
        "sitting person",
        lambda: person(SITTING_BACK, _SITTING_MAN),
        "person",
        "floor",
        texture_px=128,
    ),
    Item(
        "person_man_walking", "walking person", lambda: person(WALKING, _WALKING_MAN), "person", "floor", texture_px=128
    ),
    Item("person_woman_phoning", "person", lambda: person(PHONING, _PHONING_WOMAN), "person", "floor", texture_px=128),
    Item(
        "person_man_arms_crossed",
        "person",
        lambda: person(ARMS_CROSSED, _CROSSING_MAN),
        "person",
        "floor",
        texture_px=128,
    ),
)
