"""What the ray tracer does where that takes long: told to whoever has started it, and kept in the run's log."""

from collections.abc import Callable


def _nobody(text: str) -> None:
    """Take what is told where nobody listens."""


_listener: Callable[[str], None] = _nobody


def listen(listener: Callable[[str], None] | None) -> None:
    """Have a function take what is told in this process from now on; None for nobody."""
    global _listener
    _listener = listener or _nobody


def tell(text: str) -> None:
    """Tell what is done now, as a sentence without a full stop: `the simulator builds …`."""
    _listener(text)
