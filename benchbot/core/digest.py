"""A digest of everything that a solution was shown, so that two runs can be proven identical."""

from collections.abc import Mapping
from hashlib import sha256
from typing import Any

import numpy as np


class ObservationDigest:
    """A running SHA-256 digest of observations: names, shapes, dtypes and bytes, in sorted order of names."""

    def __init__(self) -> None:
        self._hash = sha256()

    def update(self, observations: Mapping[str, Any]) -> None:
        """Add what a solution was shown at one step."""
        self._add(observations)

    def hexdigest(self) -> str:
        """Return the digest of everything so far."""
        return self._hash.hexdigest()

    def _add(self, value: Any) -> None:
        if isinstance(value, Mapping):
            self._hash.update(b"{")
            for key in sorted(value):
                self._hash.update(f"{key}:".encode())
                self._add(value[key])
            self._hash.update(b"}")
        elif isinstance(value, np.ndarray):
            self._hash.update(f"{value.dtype.str}{value.shape}".encode())
            self._hash.update(np.ascontiguousarray(value).data)
        else:
            self._hash.update(f"{value!r};".encode())
