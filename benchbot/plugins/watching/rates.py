"""How fast something goes just now, from counts at a few moments."""

from collections import deque

WINDOW_S = 3.0


class Rates:
    """Growth per second of some counts over the last few seconds; counts that shrink begin anew."""

    def __init__(self, window_s: float = WINDOW_S) -> None:
        self._window_s = window_s
        self._moments: deque[tuple[float, tuple[float, ...]]] = deque()

    def note(self, now_s: float, *counts: float) -> tuple[float, ...]:
        """Take in what is counted now, and return by how much each grows per second."""
        moments = self._moments
        if moments and any(now < before for now, before in zip(counts, moments[-1][1], strict=True)):
            moments.clear()
        if not moments or now_s > moments[-1][0]:
            moments.append((now_s, counts))
        while len(moments) > 2 and now_s - moments[1][0] >= self._window_s:
            moments.popleft()
        passed_s = moments[-1][0] - moments[0][0]
        if passed_s <= 0:
            return (0.0,) * len(counts)
        return tuple((now - before) / passed_s for now, before in zip(moments[-1][1], moments[0][1], strict=True))
