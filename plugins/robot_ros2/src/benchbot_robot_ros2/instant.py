"""One instant: the messages of several streams that were taken at the same time."""

from collections.abc import Mapping, Sequence
from typing import TypeVar

from benchbot_robot_ros2.streams import Sample

Key = TypeVar("Key")
Stamped = tuple[int, Mapping[str, Sample]]


def joined(parts: Mapping[str, Sequence[Sample]]) -> list[Stamped]:
    """Return the stamps at which all parts of an observation were taken, and their samples by part, oldest first."""
    by_stamp = [{sample.stamp_ns: sample for sample in samples} for samples in parts.values()]
    if not by_stamp:
        return []
    common = set(by_stamp[0]).intersection(*by_stamp[1:])
    return [
        (stamp_ns, {part: samples[stamp_ns] for part, samples in zip(parts, by_stamp, strict=True)})
        for stamp_ns in sorted(common)
    ]


def one_instant(series: Mapping[Key, Sequence[Stamped]], tolerance_ns: int) -> dict[Key, Stamped] | None:
    """Return one entry of each series, all at most `tolerance_ns` apart: the earliest such, or None.

    The series are sorted by stamp. Always the one that lies farthest back moves on, so that no combination is missed
    (the smallest range covering an element of each of k lists).
    """
    places = dict.fromkeys(series, 0)
    while all(places[key] < len(entries) for key, entries in series.items()):
        chosen = {key: series[key][place] for key, place in places.items()}
        stamps = [stamp_ns for stamp_ns, _ in chosen.values()]
        if not stamps or max(stamps) - min(stamps) <= tolerance_ns:
            return chosen
        places[min(chosen, key=lambda key: chosen[key][0])] += 1
    return None
