"""Differences between the observations of two recordings, step by step: a simulated sensor and a real one."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchbot.core.plugin_manager import Plugins

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from benchbot.plugins.report.result_sets import ResultSet

Document = dict[str, Any]
UNITS = {"brightness": "of 255", "image_depth": "m", "laser": "m", "position": "m", "heading": "deg"}
"""Differences that are taken, and their units."""
BASE = "base_link"
"""The frame whose poses are compared, as nearly all robots call it (REP-105)."""


@dataclass
class _Sum:
    total: float = 0.0
    count: int = 0
    steps: int = 0

    def add(self, differences: "NDArray[Any]") -> None:
        if differences.size:
            self.total += float(differences.sum())
            self.count += differences.size
            self.steps += 1


@dataclass
class Differences:
    """Mean absolute differences by name, over what is finite in both, and the number of steps in each recording."""

    sums: dict[str, _Sum] = field(default_factory=dict)
    steps: tuple[int, int] = (0, 0)

    def as_list(self) -> list[Document]:
        """Return them as plain data, those that there are."""
        return [
            {"channel": name, "mean_absolute": sum_.total / sum_.count, "unit": UNITS[name], "steps": sum_.steps}
            for name, sum_ in self.sums.items()
            if sum_.count
        ]


def recording_of(plugins: Plugins, source: str) -> tuple[Path, Any] | None:
    """Return the recording beside a result and what reads it, None when there is none that can be read back."""
    path = Path(source)
    for name, provided in plugins.pool("recorders").items():
        folder = path.parent / f"{path.stem}-recordings" / name
        if provided.value.read is not None and folder.is_dir():
            return folder, provided.value.read
    return None


def of_scene(plugins: Plugins, a: "ResultSet", b: "ResultSet", scene: str) -> Document | None:
    """Return the differences of the first results of a scene that have recordings in both sets, None without them."""
    kept = []
    for one in (a, b):
        sources = (str(row["source"]) for row in one.document["rows"] if row["environment"] == scene)
        found = next(filter(None, (recording_of(plugins, source) for source in sources)), None)
        if found is None:
            return None
        kept.append(found)
    (folder_a, read_a), (folder_b, read_b) = kept
    found_differences = between(read_a(folder_a), read_b(folder_b))
    return {"scene": scene, "steps": list(found_differences.steps), "channels": found_differences.as_list()}


def between(one: Iterable[Mapping[str, Any]], other: Iterable[Mapping[str, Any]]) -> Differences:
    """Return the differences of two recordings, the n-th step of the one and the n-th of the other.

    Pictures and scans of different sizes are not compared, but for the brightness of pictures.
    """
    found = Differences()
    a, b = iter(one), iter(other)
    count_a = count_b = 0
    while True:
        seen_a, seen_b = next(a, None), next(b, None)
        count_a, count_b = count_a + (seen_a is not None), count_b + (seen_b is not None)
        if seen_a is None and seen_b is None:
            found.steps = (count_a, count_b)
            return found
        if seen_a is not None and seen_b is not None:
            for name, differences in _differences(seen_a, seen_b):
                found.sums.setdefault(name, _Sum()).add(differences)


def _differences(a: Mapping[str, Any], b: Mapping[str, Any]) -> "Sequence[tuple[str, NDArray[Any]]]":
    import numpy as np

    found = []
    if "image_rgb" in a and "image_rgb" in b:
        found.append(("brightness", np.array([abs(float(a["image_rgb"].mean()) - float(b["image_rgb"].mean()))])))
    if "image_depth" in a and "image_depth" in b:
        found.append(("image_depth", _finite(a["image_depth"], b["image_depth"])))
    if "laser" in a and "laser" in b:
        found.append(("laser", _finite(a["laser"]["scans"][:, 0], b["laser"]["scans"][:, 0])))
    base_a, base_b = (seen.get("poses", {}).get(BASE) for seen in (a, b))
    if base_a is not None and base_b is not None:
        away_m = math.dist(base_a["translation_xyz"][:2], base_b["translation_xyz"][:2])
        turned_rad = float(base_a["rotation_rpy"][2] - base_b["rotation_rpy"][2])
        turned_deg = abs(math.degrees(math.remainder(turned_rad, math.tau)))
        found += [("position", np.array([away_m])), ("heading", np.array([turned_deg]))]
    return found


def _finite(a: "NDArray[Any]", b: "NDArray[Any]") -> "NDArray[Any]":
    import numpy as np

    if a.shape != b.shape:
        return np.empty(0)
    usable = np.isfinite(a) & np.isfinite(b)
    differences: NDArray[Any] = np.abs(a[usable].astype(np.float64) - b[usable])
    return differences
