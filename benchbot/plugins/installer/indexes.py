"""Package indexes and folders of wheels: options for pip and uv, downloads, and search by name (PEP 503, PEP 691).

User names, passwords and tokens in addresses stay out of everything that is printed and of the options of processes.
"""

import base64
import http.client
import json
import os
import re
import urllib.error
import urllib.request
from collections.abc import Sequence
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

from packaging.utils import canonicalize_name

import benchbot
from benchbot.core.errors import BenchbotError

PYPI = "https://pypi.org/simple"
TIMEOUT_S = 60.0
MAX_BYTES = 2**30
_CREDENTIALS = re.compile(r"(?<=://)[^/@\s]+@")
_ACCEPT = "application/vnd.pypi.simple.v1+json, application/vnd.pypi.simple.v1+html;q=0.2, text/html;q=0.1"


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
        """Return the rest as environment variables of these names: other users can read the options of a process."""
        found = {} if self.url is None else {url: self.url}
        return {**found, **({extra_urls: " ".join(self.extra_urls)} if self.extra_urls else {})}

    @property
    def addresses(self) -> list[str]:
        """The addresses of all indexes that are asked."""
        configured = (os.environ.get(name) for name in ("UV_DEFAULT_INDEX", "UV_INDEX_URL", "PIP_INDEX_URL"))
        first = self.url or next(filter(None, configured), PYPI)
        return [] if self.offline else [first, *self.extra_urls]


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


def search(word: str, addresses: Sequence[str], prefix: str = "benchbot-") -> list[str]:
    """Return the normalized names in indexes that begin with `prefix` and contain `word`.

    Raises BenchbotError for an index that offers no list of names.
    """
    found = {str(canonicalize_name(name)) for address in addresses for name in _project_names(address)}
    return sorted(name for name in found if name.startswith(prefix) and canonicalize_name(word) in name)


def _project_names(address: str) -> list[str]:
    if not address.startswith(("http://", "https://")):
        raise _not_searchable(address, "It is no http or https address.")
    text = fetch(f"{address.rstrip('/')}/", _ACCEPT).decode("utf-8", "replace")
    if text.lstrip().startswith("{"):
        try:
            return [str(project["name"]) for project in json.loads(text)["projects"]]
        except (ValueError, KeyError, TypeError) as error:
            raise _not_searchable(address, "Its answer is not the list of PEP 691.") from error
    page = _LinkTexts()
    page.feed(text)
    if not page.names:
        raise _not_searchable(address, "It offers no list of names.")
    return page.names


def _not_searchable(address: str, why: str) -> BenchbotError:
    title = f"{without_credentials(address)} cannot be searched."
    return BenchbotError(title, why, "Look at its web page, or name another with --index-url URL.")


class _LinkTexts(HTMLParser):
    """Collects the texts of the links on a page: in PEP 503 these are the names of projects."""

    def __init__(self) -> None:
        super().__init__()
        self.names: list[str] = []
        self._in_link = False

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self._in_link = tag == "a"

    def handle_endtag(self, tag: str) -> None:
        self._in_link = False

    def handle_data(self, data: str) -> None:
        if self._in_link and data.strip():
            self.names.append(data.strip().rstrip("/"))
