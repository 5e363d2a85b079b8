"""Where distributions come from: package indexes and folders of wheels. What is secret in their addresses stays so."""

import os
import re
from dataclasses import dataclass
from pathlib import Path

_USER = re.compile(r"(?<=://)[^/@\s]+@")
PYPI = "https://pypi.org/simple"


@dataclass(frozen=True)
class Indexes:
    """What was asked for; None and nothing leave it to what the installer is configured with."""

    url: str | None = None
    extra_urls: tuple[str, ...] = ()
    offline: bool = False
    links: tuple[Path, ...] = ()

    def words(self) -> list[str]:
        """Return the options of pip and uv that hold no secret."""
        links = [word for folder in self.links for word in ("--find-links", str(folder.expanduser().absolute()))]
        return [*(["--no-index"] if self.offline else []), *links]

    def variables(self, url: str, extra_urls: str) -> dict[str, str]:
        """Return the rest by names of environment variables: other users can read the options of a process."""
        found = {} if self.url is None else {url: self.url}
        return {**found, **({extra_urls: " ".join(self.extra_urls)} if self.extra_urls else {})}

    @property
    def addresses(self) -> list[str]:
        """The addresses of all indexes that are asked."""
        configured = (os.environ.get(name) for name in ("UV_DEFAULT_INDEX", "UV_INDEX_URL", "PIP_INDEX_URL"))
        first = self.url or next(filter(None, configured), PYPI)
        return [] if self.offline else [first, *self.extra_urls]


def public(text: str) -> str:
    """Return a text without the user names, passwords and tokens in its URLs."""
    return _USER.sub("", text)
