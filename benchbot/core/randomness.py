"""Randomness of a run: every random number in it is derived from its seed and, if it has one, its secret.

With a secret, a solution is told a commitment to both (a hash) and nothing else; they are disclosed in the result. Keys
are derived by HMAC-SHA256 (RFC 2104), so that whoever knows one stream, or all of this code, knows nothing of another.
"""

import hashlib
import hmac
import re
import secrets
from pathlib import Path
from typing import TYPE_CHECKING

from benchbot.core.errors import BenchbotError

if TYPE_CHECKING:
    import numpy as np

SECRET_DIGITS = 32
"""The least number of hexadecimal digits of a secret: 128 bits."""
HOW_TO_MAKE_ONE = "python -c 'import secrets; print(secrets.token_hex(32))' > secret.txt"


def new_secret() -> str:
    """Return 128 bits from the operating system, in hexadecimal digits."""
    return secrets.token_hex(SECRET_DIGITS // 2)


def read_secret(path: Path) -> str:
    """Return the secret in a file: its hexadecimal digits, in lower case; raises BenchbotError for too few, or others.

    The error does not quote the file.
    """
    try:
        text = path.read_text("utf-8").strip().lower()
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "It is not a text."
        raise BenchbotError(f"There is no secret in {path}.", f"{why}", f"Make one: {HOW_TO_MAKE_ONE}") from error
    if not is_secret(text):
        raise BenchbotError(
            f"There is no secret in {path}.",
            f"It must hold hexadecimal digits alone, an even number, and {SECRET_DIGITS} of them or more (128 bits).",
            f"Make one: {HOW_TO_MAKE_ONE}",
        )
    return text


def is_secret(text: str) -> bool:
    """Say whether a text is a secret of 128 bits or more, in hexadecimal digits in lower case."""
    return len(text) >= SECRET_DIGITS and len(text) % 2 == 0 and re.fullmatch("[0-9a-f]+", text) is not None


def commitment(secret: str, seed: int) -> str:
    """Return what binds a run to its secret and seed and tells neither: as `echo SECRET SEED | sha256sum` prints it."""
    return hashlib.sha256(f"{secret} {seed}\n".encode()).hexdigest()


def key(secret: str, seed: int, *stream: str | int) -> int:
    """Return the key (256 bits) of what is drawn under a name: the HMAC-SHA256 of seed and name with the secret."""
    return int.from_bytes(_derived(bytes.fromhex(secret), seed, *stream), "big")


def scene_seed(secret: str, seed: int, scene_index: int) -> int:
    """Return the seed that a platform loads a scene with: the run's plus the scene's number; with a secret, a key."""
    return key(secret, seed, "scene", scene_index) if secret else seed + scene_index


def generator(seed: int, stream: str, instant: int = 0) -> "np.random.Generator":
    """Return the generator of a platform's noise: of the sensor or motion `stream`, at an instant since `load`.

    `seed` is that of `load`. Generators of other streams and instants tell nothing of this one, so that a sensor's
    noise does not depend on what was sensed before or beside. Philox counts (Salmon et al., "Parallel random numbers:
    as easy as 1, 2, 3", 2011): it begins where the derived 256 bits say, at no cost.
    """
    from numpy.random import Generator, Philox

    derived = _derived(seed.to_bytes((seed.bit_length() + 7) // 8 or 1, "big"), stream, instant)
    return Generator(Philox(key=int.from_bytes(derived[:16], "big"), counter=int.from_bytes(derived[16:], "big")))


def _derived(key: bytes, *names: str | int) -> bytes:
    # No name holds a zero byte, so that different names are different messages.
    return hmac.digest(key, "\0".join(map(str, names)).encode(), "sha256")
