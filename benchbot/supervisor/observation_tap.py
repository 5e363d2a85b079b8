"""Observations for those who watch a run: copies, thinned out, and made only while there are requests for them."""

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchbot.supervisor.platform import borrowed

PERIOD_S = 0.1
ATTENTION_S = 2.0
"""Snapshots for which there was no request in so long are made no more."""
MAX_REQUESTS = 8
IMAGES = frozenset({"image_rgb", "image_depth", "image_segment"})


@dataclass(frozen=True)
class SnapshotRequest:
    """Some channels, their images at most `width` pixels wide."""

    channels: tuple[str, ...]
    width: int


@dataclass(frozen=True)
class Snapshot:
    """The copy of an observation, by its number among those of its run, with every `stride`-th pixel of its images."""

    number: int
    stride: int
    observations: dict[str, object]


@dataclass
class _Subscription:
    asked_s: float
    made_s: float = float("-inf")
    snapshot: Snapshot | None = None


class ObservationTap:
    """Makes snapshots of a run's observations. Safe to use from any thread; unused, it costs a comparison a step.

    The arrays that it is offered may be borrowed: they are read until they are withdrawn, and never after.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._subscriptions: dict[SnapshotRequest, _Subscription] = {}
        self._observations: Mapping[str, object] | None = None
        self.number = 0
        """The number of observations so far."""

    def offer(self, observations: Mapping[str, object]) -> None:
        """Take in an observation, which stays as it is until it is withdrawn."""
        with self._lock:
            self._observations = observations
            self.number += 1
            now_s = time.monotonic()
            for request, subscription in list(self._subscriptions.items()):
                if now_s - subscription.asked_s > ATTENTION_S:
                    del self._subscriptions[request]
                else:
                    self._copy(request, subscription, now_s)

    def withdraw(self) -> None:
        """Read the last observation no more: it may change from now on."""
        with self._lock:
            self._observations = None

    def snapshot(self, request: SnapshotRequest, after: int) -> Snapshot | None:
        """Return the newest snapshot, or None when there is none that is newer than number `after`."""
        now_s = time.monotonic()
        with self._lock:
            subscription = self._subscriptions.get(request)
            if subscription is None:
                if len(self._subscriptions) >= MAX_REQUESTS:
                    oldest = min(self._subscriptions, key=lambda each: self._subscriptions[each].asked_s)
                    del self._subscriptions[oldest]
                subscription = self._subscriptions[request] = _Subscription(now_s)
            subscription.asked_s = now_s
            self._copy(request, subscription, now_s)
            newest = subscription.snapshot
        return newest if newest is not None and newest.number > after else None

    def _copy(self, request: SnapshotRequest, subscription: _Subscription, now_s: float) -> None:
        has_newest = subscription.snapshot is not None and subscription.snapshot.number == self.number
        if self._observations is not None and not has_newest and now_s - subscription.made_s >= PERIOD_S:
            subscription.made_s = now_s
            subscription.snapshot = thinned(self._observations, request, self.number)


def thinned(observations: Mapping[str, object], request: SnapshotRequest, number: int) -> Snapshot:
    """Return a copy of the channels that are asked for. Of images, every n-th row and column; a class stays a class."""
    chosen = {name: observations[name] for name in request.channels if name in observations}
    stride = max([1, *(-(-_width(chosen[name]) // request.width) for name in chosen if name in IMAGES)])
    return Snapshot(
        number,
        stride,
        {name: _thinned(value, stride) if name in IMAGES else borrowed.copied(value) for name, value in chosen.items()},
    )


def _width(value: Any) -> int:
    images = value.values() if isinstance(value, dict) else [value]
    return max((image.shape[1] for image in images if isinstance(image, np.ndarray) and image.ndim >= 2), default=1)


def _thinned(value: Any, stride: int) -> Any:
    if isinstance(value, dict):
        return {key: _thinned(item, stride) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.ndim >= 2:
        return value[::stride, ::stride].copy()
    return borrowed.copied(value)
