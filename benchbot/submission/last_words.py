"""What a program printed last, for whoever asks why it ended."""

MAX_BYTES = 4000
MAX_LINES = 5


class LastWords:
    """The end of a program's output, taken in chunk by chunk."""

    def __init__(self) -> None:
        self._end = b""

    def add(self, chunk: bytes) -> None:
        """Take in what the program prints."""
        self._end = (self._end + chunk)[-MAX_BYTES:]

    def __str__(self) -> str:
        lines = [line.strip() for line in self._end.decode("utf-8", "replace").splitlines()]
        return "\n".join([line for line in lines if line][-MAX_LINES:])
