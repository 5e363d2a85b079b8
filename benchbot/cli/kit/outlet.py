"""Writing to a terminal, or whatever stderr is, without ever waiting for it: it may have been stopped with Ctrl-S."""

import os
import threading
import time
from contextlib import suppress

PENDING_BYTES = 2**20
"""What is kept for a terminal that takes nothing; the rest of what is printed is not shown."""
PERIOD_S = 0.1
PATIENCE_S = 2.0
_ERASE = b"\r\x1b[K"


class Outlet:
    """A thread that writes to a file descriptor (None: nowhere). Safe to use from any thread.

    What is printed is written in order, and the status below it as it is then, at most ten times a second. With `keep`,
    who prints waits rather than lose anything: for files and pipes. A thread that a terminal never lets go of ends with
    its process.
    """

    def __init__(self, handle: int | None, *, keep: bool) -> None:
        self._handle = handle
        self._keep = keep
        self._changed = threading.Condition()
        self._printed: list[tuple[bytes, bool]] = []
        self._pending_bytes = 0
        self._lost_bytes = 0
        self._status = b""
        self._shown = b""
        self._at_line_start = True
        self._closing = False
        self._nobody_reads = handle is None
        self._thread: threading.Thread | None = None

    def write(self, data: bytes) -> None:
        """Print what somebody else has written, untouched."""
        with self._changed:
            while self._keep and self._is_full and not self._nobody_reads:
                self._changed.wait()
            if self._is_full:
                self._lost_bytes += len(data)
            else:
                self._add(data, ours=False)

    def say(self, line: bytes) -> None:
        """Print a line of ours; never waits."""
        with self._changed:
            if not self._is_full:
                self._add(line + b"\n", ours=True)

    def show(self, status: bytes) -> None:
        """Show a status below what is printed from now on; empty for none."""
        with self._changed:
            self._status = status
            self._wake()

    def close(self) -> None:
        """Remove the status, and write what is left; a terminal that takes nothing is waited for a moment only."""
        with self._changed:
            self._status, self._closing = b"", True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join(None if self._keep else PATIENCE_S)

    @property
    def _is_full(self) -> bool:
        return self._pending_bytes > PENDING_BYTES

    def _add(self, data: bytes, *, ours: bool) -> None:
        self._printed.append((data, ours))
        self._pending_bytes += len(data)
        self._wake()

    def _wake(self) -> None:
        if self._thread is None and not self._nobody_reads:
            self._thread = threading.Thread(target=self._write_all, name="benchbot-outlet", daemon=True)
            self._thread.start()
        self._changed.notify_all()

    def _write_all(self) -> None:
        drew_s = float("-inf")
        while True:
            with self._changed:
                while not self._printed and not self._closing:
                    left_s = drew_s + PERIOD_S - time.monotonic() if self._status != self._shown else None
                    if left_s is not None and left_s <= 0:
                        break
                    self._changed.wait(left_s)
                if self._closing and not self._printed and not self._shown:
                    return
                data, taken_bytes = self._composed()
            drew_s = time.monotonic()
            gone = not self._put(data)
            with self._changed:
                self._pending_bytes -= taken_bytes
                self._nobody_reads |= gone
                self._changed.notify_all()
            if gone:
                return

    def _composed(self) -> tuple[bytes, int]:
        """Return what is to be written now, and how much of it was pending."""
        parts = [_ERASE] if self._shown else []
        taken_bytes = 0
        for data, ours in self._printed:
            if ours and not self._at_line_start:
                parts.append(b"\n")
            parts.append(data)
            taken_bytes += len(data)
            self._at_line_start = data.endswith((b"\n", b"\r"))
        if self._lost_bytes:
            parts.append(b"\n[%d bytes are not shown: the terminal did not take them]\n" % self._lost_bytes)
            self._at_line_start, self._lost_bytes = True, 0
        self._printed = []
        # Below half a line, such as a question that a solution asks, there is no room for a status.
        self._shown = self._status if self._at_line_start else b""
        return b"".join([*parts, self._shown]), taken_bytes

    def _put(self, data: bytes) -> bool:
        """Write data; say whether somebody reads it. That nobody does must not end the episode."""
        with suppress(OSError):
            while data:
                data = data[os.write(self._handle or 0, data) :]
        return not data
