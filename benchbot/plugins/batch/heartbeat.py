"""The heartbeat of a claim: it tells others that whoever holds it lives."""

import threading
from contextlib import suppress
from typing import Self

from benchbot.plugins.batch.claims import HeldClaim

HEARTBEATS_PER_SILENCE = 15
LONGEST_HEARTBEAT_S = 2.0


class Heartbeat:
    """Beats a claim in a thread for as long as the context lasts."""

    def __init__(self, claim: HeldClaim, stale_s: float) -> None:
        self._claim = claim
        self._period_s = min(LONGEST_HEARTBEAT_S, stale_s / HEARTBEATS_PER_SILENCE)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="benchbot-heartbeat", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _beat(self) -> None:
        while not self._ended.wait(self._period_s):
            # A shared folder may be away for a while: others will say whether the claim is lost.
            with suppress(OSError):
                self._claim.beat()
