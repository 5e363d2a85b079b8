"""Package indexes and folders of wheels: options for pip and uv, and downloads.

User names, passwords and tokens in addresses stay out of everything that is printed and of the options of processes.
"""

import base64
import http.client
import os
import re
import urllib.error
import urllib.request
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote, urlsplit

import benchbot
from benchbot.core.errors import BenchbotError

PYPI = "https://pypi.org/simple"
TIMEOUT_S = 60.0
MAX_BYTES = 2**30
_CREDENTIALS = re.compile(r"(?<=://)[^/@\s]+@")


@dataclass(frozen=True)
class Indexes:
    """Indexes and folders of wheels to search; None or empty leaves the choice to the installer's configuration."""

    url: str | None = None
    extra_urls: tuple[str, ...] = ()
    offline: bool = False
    links: tuple[Path, ...] = ()

    def options(self) -> list[str]:
        """Return the options of pip and uv that hold no secret."""
        links = [word for folder in self.links for word in ("--find-links", str(folder.expanduser().absolute()))]
        return [*(["--no-index"] if self.offline else []), *links]

    def variables(self, url: str, extra_urls: str) -> dict[str, str]:
        """Return the rest as environment variables of these names: other users can read the options of a process.

        The index that the environment names for uv or pip is passed to the other one, too: both install from one place.
        """
        first = self.url or (None if url in os.environ else _configured())
        found = {} if first is None else {url: first}
        return {**found, **({extra_urls: " ".join(self.extra_urls)} if self.extra_urls else {})}

    @property
    def addresses(self) -> list[str]:
        """The addresses of all indexes that are asked."""
        return [] if self.offline else [self.url or _configured() or PYPI, *self.extra_urls]


def _configured() -> str | None:
    variables = (os.environ.get(name) for name in ("UV_DEFAULT_INDEX", "UV_INDEX_URL", "PIP_INDEX_URL"))
    return next(filter(None, variables), None)


def without_credentials(text: str) -> str:
    """Return a text without the user names, passwords and tokens in its URLs."""
    return _CREDENTIALS.sub("", text)


def fetch(url: str, accept: str) -> bytes:
    """Download an http(s) address, with the credentials in it; raises BenchbotError, which does not show them."""
    public = without_credentials(url)
    parts = urlsplit(url)
    headers = {"Accept": accept, "User-Agent": f"benchbot/{benchbot.__version__}"}
    if parts.username is not None:
        secret = f"{unquote(parts.username)}:{unquote(parts.password or '')}"
        headers["Authorization"] = f"Basic {base64.b64encode(secret.encode()).decode()}"
    if parts.scheme not in ("http", "https"):
        raise BenchbotError(f"{public} cannot be fetched.", "It is no http or https address.", "Check it.")
    host = parts.netloc.rpartition("@")[2]
    request = urllib.request.Request(parts._replace(netloc=host).geturl(), headers=headers)  # noqa: S310
    try:
        with urllib.request.urlopen(request, timeout=TIMEOUT_S) as response:  # noqa: S310
            content = bytes(response.read(MAX_BYTES + 1))
    except (OSError, http.client.HTTPException, ValueError) as error:
        reason = f"{error.code} {error.reason}" if isinstance(error, urllib.error.HTTPError) else str(error)
        raise BenchbotError(
            f"{public} cannot be fetched.", f"{without_credentials(reason)}.", "Check the address and the network."
        ) from error
    if len(content) > MAX_BYTES:
        raise BenchbotError(f"{public} is too large.", "It is over 1 GiB.", "Fetch it yourself, and name the file.")
    return content
