"""One question that a renderer is asked again and again, and how to read its answer."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class Job:
    """`run` is what is timed; `read` turns what it returned into an array that is compared with ours.

    `measure` says which of our figures it stands beside: primary, shadow, bounce (what was hit: bool (N,)), frame
    (instances (H, W)), or path (mean radiance (3,)); `work` is in rays or samples.
    """

    measure: str
    peer: str
    work: int
    run: Callable[[], Any]
    read: Callable[[Any], npt.NDArray[Any]]


def found(distance: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
    """Whether each ray met something."""
    hits: npt.NDArray[np.bool_] = np.isfinite(distance) & (distance < 1e4)
    return hits
