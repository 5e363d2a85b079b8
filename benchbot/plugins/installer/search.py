"""Finding plug-ins by name in the list that a package index offers (PEP 503 and PEP 691)."""

import json
from collections.abc import Sequence
from html.parser import HTMLParser

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.distributions import normal
from benchbot.plugins.installer.fetching import fetch
from benchbot.plugins.installer.indexes import public

ACCEPT = "application/vnd.pypi.simple.v1+json, application/vnd.pypi.simple.v1+html;q=0.2, text/html;q=0.1"


def search(word: str, addresses: Sequence[str], prefix: str = "benchbot-") -> list[str]:
    """Return the names that hold a word, among those that begin with `prefix`; raises BenchbotError for no list."""
    found: set[str] = set()
    for address in addresses:
        found |= {normal(name) for name in _names(address)}
    wanted = normal(word)
    return sorted(name for name in found if name.startswith(prefix) and wanted in name)


def _names(address: str) -> list[str]:
    if not address.startswith(("http://", "https://")):
        raise _not_searchable(address, "It is no http or https address.")
    text = fetch(f"{address.rstrip('/')}/", ACCEPT).decode("utf-8", "replace")
    if text.lstrip().startswith("{"):
        try:
            return [str(project["name"]) for project in json.loads(text)["projects"]]
        except (ValueError, KeyError, TypeError) as error:
            raise _not_searchable(address, "Its answer is not the list of PEP 691.") from error
    links = _Links()
    links.feed(text)
    if not links.names:
        raise _not_searchable(address, "It offers no list of names.")
    return links.names


def _not_searchable(address: str, why: str) -> BenchbotError:
    return BenchbotError(
        f"{public(address)} cannot be searched.", why, "Look at its web page, or name another with --index-url URL."
    )


class _Links(HTMLParser):
    """The texts of the links on a page: in PEP 503 these are the names."""

    def __init__(self) -> None:
        super().__init__()
        self.names: list[str] = []
        self._inside = False

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self._inside = tag == "a"

    def handle_endtag(self, tag: str) -> None:
        self._inside = False

    def handle_data(self, data: str) -> None:
        if self._inside and data.strip():
            self.names.append(data.strip().rstrip("/"))
