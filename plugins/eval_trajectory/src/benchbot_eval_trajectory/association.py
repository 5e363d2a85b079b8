"""Association: which pose of one trajectory belongs to which of another, by time.

Two rules are in use, which agree where the poses of both are further apart than they are from their counterparts.
"""

from enum import StrEnum

import numpy as np

from benchbot_eval_trajectory.trajectory import Floats, Indices

MAX_DIFFERENCE_S = 0.01
"""Half the period of a recording with 50 poses a second; what the tools of the TUM RGB-D benchmark take for granted."""


class Association(StrEnum):
    """The rules: that of evo, and that of the TUM RGB-D benchmark's own tools."""

    EVO = "evo"
    TUM = "tum"


def associate(
    times_s: Floats,
    others_s: Floats,
    max_difference_s: float = MAX_DIFFERENCE_S,
    rule: Association = Association.EVO,
) -> tuple[Indices, Indices]:
    """Return the numbers (M,) of poses that belong together, in order; neither argument decreases.

    None that belong together are further apart than `max_difference_s`.
    """
    if rule is Association.TUM:
        return _closest_first(times_s, others_s, max_difference_s)
    if len(times_s) > len(others_s):
        theirs, ours = associate(others_s, times_s, max_difference_s, rule)
        return ours, theirs
    return _each_with_its_nearest(times_s, others_s, max_difference_s)


def _each_with_its_nearest(few_s: Floats, many_s: Floats, max_difference_s: float) -> tuple[Indices, Indices]:
    """Return each pose of the trajectory with fewer poses with the one nearest in time: it may belong to several.

    github.com/MichaelGrupp/evo, `evo.core.sync` in version 1.38.
    """
    if not len(few_s):
        return np.arange(0), np.arange(0)
    nearest = _nearest(few_s, many_s)
    close = np.abs(few_s - many_s[nearest]) <= max_difference_s
    return np.flatnonzero(close), nearest[close]


def _closest_first(times_s: Floats, others_s: Floats, max_difference_s: float) -> tuple[Indices, Indices]:
    """Return the two that are closest in time, then the two closest of the rest, and so on (Sturm et al. 2012).

    No pose belongs to two.
    """
    left, right = np.arange(len(times_s)), np.arange(len(others_s))
    found_left, found_right = [left[:0]], [right[:0]]
    while len(left) and len(right):
        # Two that are nearest to each other belong together, whatever becomes of the others.
        nearest = _nearest(times_s[left], others_s[right])
        mutual = _nearest(others_s[right], times_s[left])[nearest] == np.arange(len(left))
        close = np.abs(times_s[left] - others_s[right][nearest]) <= max_difference_s
        chosen = mutual & close
        if not chosen.any():
            break
        found_left.append(left[chosen])
        found_right.append(right[nearest[chosen]])
        right = np.delete(right, nearest[chosen])
        # What is too far from everything stays so.
        left = left[~chosen & close]
    order = np.argsort(np.concatenate(found_left))
    return np.concatenate(found_left)[order], np.concatenate(found_right)[order]


def _nearest(values: Floats, among: Floats) -> Indices:
    """Return for each value the number of the nearest of `among`, which never decreases; the earlier of two times."""
    above = np.clip(np.searchsorted(among, values, side="right"), 1, max(len(among) - 1, 1))
    above = np.minimum(above, len(among) - 1)
    below = np.maximum(above - 1, 0)
    nearest: Indices = np.where(values - among[below] <= among[above] - values, below, above)
    return nearest
