"""Claims: which worker computes which episode, recorded in files alone, so that it works on any shared folder.

A claim is a file made by O_CREAT | O_EXCL, which is atomic also on NFS (open(2)). Its worker counts in it while it
lives. An observer that sees the count stand still for long enough, by its own monotonic clock, or knows that the
worker's process is dead, takes the claim away by renaming it: of several that try, one succeeds.
"""

import json
import os
import secrets
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from benchbot.plugins.batch.machine import ProcessId

HEARTBEATS_PER_SILENCE = 15
LONGEST_HEARTBEAT_S = 2.0
_COUNT_DIGITS = 20


@dataclass(frozen=True)
class Claim:
    """The content of a claim file: its worker, a token that no other claim has, and the count of its heartbeat."""

    worker: str
    token: str
    process: ProcessId
    count: int

    @classmethod
    def read(cls, path: Path) -> Self | None:
        """Return a claim, or None when there is none, or none that can be read (yet)."""
        try:
            head, count = path.read_text("utf-8").split("\n")[:2]
            document = json.loads(head)
            return cls(str(document["worker"]), str(document["token"]), ProcessId.from_dict(document), int(count))
        except (OSError, ValueError, TypeError, KeyError):
            return None


class HeldClaim:
    """A claim of this process. `beat` may be called from another thread."""

    def __init__(self, path: Path, token: str, handle: int, count_at: int) -> None:
        self.path = path
        self.token = token
        self._handle = handle
        self._count_at = count_at
        self._count = 0

    @classmethod
    def take(cls, path: Path, worker: str) -> Self | None:
        """Make the claim file at `path`, or return None when it is there already; raises OSError."""
        token = secrets.token_hex(8)
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        except FileExistsError:
            return None
        head = json.dumps({"worker": worker, "token": token, **ProcessId.of(os.getpid()).as_dict()}) + "\n"
        claim = cls(path, token, handle, len(head.encode()))
        try:
            os.write(handle, head.encode())
            claim.beat()
        except OSError:
            os.close(handle)
            path.unlink(missing_ok=True)
            raise
        return claim

    def beat(self) -> None:
        """Show that this process lives: rewrites as many bytes as there were, so that a full disk does not matter."""
        self._count += 1
        os.pwrite(self._handle, f"{self._count:0{_COUNT_DIGITS}d}\n".encode(), self._count_at)

    @property
    def is_mine(self) -> bool:
        """Whether it has not been taken away."""
        found = Claim.read(self.path)
        return found is not None and found.token == self.token

    def release(self) -> None:
        """Let go of it, if it is still this process's."""
        if self._handle < 0:
            return
        if self.is_mine:
            with suppress(OSError):
                self.path.unlink()
        os.close(self._handle)
        self._handle = -1


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
            # A shared folder may be away for a while: the observers decide whether the claim is lost.
            with suppress(OSError):
                self._claim.beat()


class Observer:
    """Watches the claims of others in a folder, and takes away those of workers that are dead."""

    def __init__(self, folder: Path, stale_s: float) -> None:
        self._folder = folder
        self._stale_s = stale_s
        self._seen: dict[str, tuple[object, float]] = {}

    def keys(self) -> set[str]:
        """Return the keys of all claims, those of dead workers among them."""
        try:
            return {path.name for path in self._folder.iterdir() if "." not in path.name}
        except FileNotFoundError:
            return set()

    def claims(self) -> Iterator[tuple[str, Claim]]:
        """Yield the claims that can be read, by their keys."""
        for key in sorted(self.keys()):
            claim = Claim.read(self._folder / key)
            if claim is not None:
                yield key, claim

    def is_stale(self, key: str) -> bool:
        """Say whether a claim's worker is dead, or has been silent for too long, between calls of this method."""
        path = self._folder / key
        claim = Claim.read(path)
        if claim is not None and claim.process.is_dead:
            return True
        now_s = time.monotonic()
        # A claim whose worker died before it could write is one, too: it stays as it is.
        state = claim or (path.stat().st_mtime_ns if path.exists() else None)
        if state is None or key not in self._seen or self._seen[key][0] != state:
            self._seen[key] = (state, now_s)
            return False
        return now_s - self._seen[key][1] > self._stale_s

    def steal(self, key: str) -> Claim | None:
        """Take a stale claim away, so that it can be claimed anew; return its content.

        Returns None when another observer was faster, and for a file that nothing was written into.
        """
        path = self._folder / key
        judged = Claim.read(path)
        aside = self._folder / f"{key}.stale.{secrets.token_hex(4)}"
        try:
            path.rename(aside)
        except FileNotFoundError:
            return None
        taken = Claim.read(aside)
        if taken is not None and (judged is None or taken.token != judged.token):
            # Another observer was faster, and this is the claim of the episode's next worker: it gets it back.
            with suppress(FileExistsError, FileNotFoundError):
                os.link(aside, path)
                aside.unlink()
            return None
        self._seen.pop(key, None)
        return taken
