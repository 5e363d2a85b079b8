"""Draws maps of objects as coloured boxes in three dimensions; the functions are those of BenchBot v2's `extras`."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.api.tools.panels import set_axes_equal
from benchbot.core.errors import BenchbotError, FailureClass, did_you_mean

# Names of CSS colours: tableware in reds, food in its own colours, electronics in greys and blues, furniture in browns.
CLASS_TO_COLOR_MAP = {
    "bottle": "limegreen",
    "cup": "tomato",
    "knife": "lightcoral",
    "bowl": "indianred",
    "wine glass": "maroon",
    "fork": "salmon",
    "spoon": "darksalmon",
    "banana": "gold",
    "apple": "red",
    "orange": "darkorange",
    "cake": "hotpink",
    "potted plant": "forestgreen",
    "mouse": "darkgrey",
    "keyboard": "dimgrey",
    "laptop": "slategrey",
    "cell phone": "black",
    "book": "mediumpurple",
    "clock": "darkkhaki",
    "chair": "peru",
    "table": "saddlebrown",
    "couch": "chocolate",
    "bed": "tan",
    "toilet": "powderblue",
    "tv": "midnightblue",
    "microwave": "steelblue",
    "toaster": "cornflowerblue",
    "refrigerator": "deepskyblue",
    "oven": "royalblue",
    "sink": "turquoise",
    "person": "magenta",
}

# The corners of a box, first below and then above, each counter-clockwise from (-x, +y), and its sides by corner.
_CORNERS = np.array([(x, y, z) for z in (-1, 1) for x, y in ((-1, 1), (-1, -1), (1, -1), (1, 1))]) / 2
_SIDES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def get_bbox3d(extent: Sequence[float], centroid: Sequence[float]) -> NDArray[np.float64]:
    """Return the corners (8, 3) of a box from its full sizes and its middle, in metres."""
    corners: NDArray[np.float64] = _CORNERS * np.asarray(extent, np.float64) + np.asarray(centroid, np.float64)
    return corners


def vis_bbox3d(ax: Any, bbox3d: NDArray[np.float64], facecolor: Any, edgecolor: Any, label: str) -> None:
    """Draw a box, given by its corners (8, 3), into three-dimensional matplotlib axes."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    sides = [bbox3d[list(side)] for side in _SIDES]
    ax.add_collection3d(
        Poly3DCollection(sides, facecolors=facecolor, edgecolors=edgecolor, linewidths=1, alpha=0.25, label=label)
    )
    ax.scatter(*bbox3d.T, s=1, color=edgecolor)


def vis_semantic_map3d(
    ax: Any, scene_objects: Iterable[Mapping[str, Any]], class_to_color_map: Mapping[str, Any], edgecolor: Any
) -> None:
    """Draw objects {class, centroid, extent}, as a ground truth has them, into three-dimensional matplotlib axes.

    Raises BenchbotError for a class without a colour.
    """
    corners = []
    for item in scene_objects:
        label = item["class"]
        if label not in class_to_color_map:
            raise BenchbotError(
                f"The class '{label}' has no colour.",
                f"There are colours for: {', '.join(class_to_color_map)}."
                f"{did_you_mean(label, list(class_to_color_map))}",
                "Add it: vis_semantic_map3d(ax, objects, {**CLASS_TO_COLOR_MAP, 'my class': 'red'}, edgecolor)",
                failure=FailureClass.AGENT,
            )
        bbox3d = get_bbox3d(item["extent"], item["centroid"])
        vis_bbox3d(ax, bbox3d, class_to_color_map[label], edgecolor, label)
        corners.append(bbox3d)
    if corners:
        set_axes_equal(ax, np.concatenate(corners))
