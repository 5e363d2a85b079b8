"""What those who look on are shown of the observations: copies, thinned out, and only while somebody looks."""

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchbot.supervisor.platform import borrowed

PERIOD_S = 0.1
ATTENTION_S = 2.0
"""Who has not looked for so long does not look any more."""
MOST_ORDERS = 8
IMAGES = frozenset({"image_rgb", "image_depth", "image_segment"})


@dataclass(frozen=True)
class Order:
    """What somebody wants to see: some channels, their images at most so many pixels wide."""

    channels: tuple[str, ...]
    width: int


@dataclass(frozen=True)
class Sight:
    """The copy of an observation, by the number that it has among those of its run."""

    number: int
    stride: int
    observations: dict[str, Any]


@dataclass
class _Watched:
    wanted_s: float
    made_s: float = float("-inf")
    sight: Sight | None = None


class Onlooker:
    """Stands beside a run. Safe to use from any thread; while nobody looks, it costs a comparison a step.

    The arrays that it is offered may be lent: they are looked at until they are withdrawn, and never after.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._watched: dict[Order, _Watched] = {}
        self._lent: Mapping[str, Any] | None = None
        self.number = 0
        """How many observations there have been."""

    def offer(self, observations: Mapping[str, Any]) -> None:
        """Show what has been observed; it stays as it is until it is withdrawn."""
        with self._lock:
            self._lent = observations
            self.number += 1
            if self._watched:
                self._copy_for_all()

    def withdraw(self) -> None:
        """Take back what was offered: it may change from now on."""
        with self._lock:
            self._lent = None

    def look(self, order: Order, after: int) -> Sight | None:
        """Return the newest observation, or None when there is none that is newer than number `after`."""
        now_s = time.monotonic()
        with self._lock:
            watched = self._watched.get(order)
            if watched is None:
                if len(self._watched) >= MOST_ORDERS:
                    del self._watched[min(self._watched, key=lambda each: self._watched[each].wanted_s)]
                watched = self._watched[order] = _Watched(now_s)
            watched.wanted_s = now_s
            self._copy(order, watched, now_s)
            sight = watched.sight
        return sight if sight is not None and sight.number > after else None

    def _copy_for_all(self) -> None:
        now_s = time.monotonic()
        for order, watched in list(self._watched.items()):
            if now_s - watched.wanted_s > ATTENTION_S:
                del self._watched[order]
            else:
                self._copy(order, watched, now_s)

    def _copy(self, order: Order, watched: _Watched, now_s: float) -> None:
        has_newest = watched.sight is not None and watched.sight.number == self.number
        if self._lent is not None and not has_newest and now_s - watched.made_s >= PERIOD_S:
            watched.made_s = now_s
            watched.sight = thinned(self._lent, order, self.number)


def thinned(observations: Mapping[str, Any], order: Order, number: int) -> Sight:
    """Return a copy of the channels that are asked for. Of images, every n-th row and column; a class stays a class."""
    chosen = {name: observations[name] for name in order.channels if name in observations}
    stride = max([1, *(-(-_width(chosen[name]) // order.width) for name in chosen if name in IMAGES)])
    return Sight(
        number,
        stride,
        {name: _thinned(value, stride) if name in IMAGES else borrowed.copied(value) for name, value in chosen.items()},
    )


def _images(value: Any) -> Sequence[NDArray[Any]]:
    values = value.values() if isinstance(value, dict) else [value]
    return [each for each in values if isinstance(each, np.ndarray) and each.ndim >= 2]


def _width(value: Any) -> int:
    return max((image.shape[1] for image in _images(value)), default=1)


def _thinned(value: Any, stride: int) -> Any:
    if isinstance(value, dict):
        return {key: _thinned(item, stride) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.ndim >= 2:
        return value[::stride, ::stride].copy()
    return borrowed.copied(value)
