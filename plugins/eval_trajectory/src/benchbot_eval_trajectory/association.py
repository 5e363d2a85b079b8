"""Association: which pose of one trajectory belongs to which of another, by time."""

import numpy as np

from benchbot_eval_trajectory.trajectory import Floats, Indices

MAX_DIFFERENCE_S = 0.01
"""Half the period of a recording with 50 poses a second; what the tools of the TUM RGB-D benchmark take for granted."""


def associate(times_s: Floats, others_s: Floats, max_difference_s: float = MAX_DIFFERENCE_S) -> tuple[Indices, Indices]:
    """Return the numbers (M,) of poses that belong together, in order; neither argument decreases.

    The two that are closest in time belong together, then the two closest of the rest, and so on, up to
    `max_difference_s` (Sturm et al. 2012). No pose belongs to two.
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
    """Return for each value the number of the nearest of `among`, which never decreases; the earlier of two."""
    above = np.clip(np.searchsorted(among, values), 1, max(len(among) - 1, 1))
    above = np.minimum(above, len(among) - 1)
    below = np.maximum(above - 1, 0)
    nearest: Indices = np.where(values - among[below] <= among[above] - values, below, above)
    return nearest
