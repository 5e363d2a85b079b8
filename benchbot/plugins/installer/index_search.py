"""Search in package indexes: names (PEP 503, PEP 691), and of those of plug-ins kind and summary (PEP 658, PEP 714)."""

import email
import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from html.parser import HTMLParser
from urllib.parse import urldefrag, urljoin

from packaging.utils import InvalidWheelFilename, canonicalize_name, parse_wheel_filename

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.indexes import fetch, without_credentials

PREFIX = "benchbot-"
KINDS = {
    "agent": "agent", "assets": "assets", "driver": "driver", "env": "environment", "environment": "environment",
    "envs": "environment", "eval": "evaluator", "evaluator": "evaluator", "executor": "executor", "plugin": "plugin",
    "record": "recorder", "robot": "robot", "sim": "simulator", "simulator": "simulator", "task": "task",
}  # fmt: skip
"""Kinds of plug-ins by what follows `benchbot-` in a name, and by the keywords that `benchbot new` writes."""
_ACCEPT = "application/vnd.pypi.simple.v1+json, application/vnd.pypi.simple.v1+html;q=0.2, text/html;q=0.1"
_AT_ONCE = 8


@dataclass(frozen=True)
class Offer:
    """A distribution that an index offers; `kind` and `summary` are empty where nothing says them."""

    name: str
    kind: str = ""
    summary: str = ""

    def holds(self, word: str) -> bool:
        """Say whether name, kind or summary hold a word."""
        return canonicalize_name(word) in self.name or word.lower() in f"{self.kind} {self.summary}".lower()


def search(word: str, addresses: Sequence[str]) -> list[Offer]:
    """Return what indexes offer whose name begins with `benchbot-`, and whose name, kind or summary hold `word`.

    Raises BenchbotError for an index that offers no list of names. One that tells no metadata is searched by name.
    """
    found: dict[str, Offer] = {}
    for address in addresses:
        names = {str(canonicalize_name(name)) for name in _project_names(address)}
        plugins = sorted(name for name in names if name.startswith(PREFIX))
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            for offer in pool.map(lambda name, address=address: _offer(name, address), plugins):
                found.setdefault(offer.name, offer)
    return [found[name] for name in sorted(found) if found[name].holds(word)]


def _offer(name: str, address: str) -> Offer:
    """Return a distribution with what the metadata of its newest wheel says, as far as the index tells it."""
    kind = KINDS.get(name.removeprefix(PREFIX).partition("-")[0], "")
    try:
        page = f"{address.rstrip('/')}/{name}/"
        wheels = sorted(_wheels_with_metadata(fetch(page, _ACCEPT).decode("utf-8", "replace"), page))
        if not wheels:
            return Offer(name, kind)
        metadata = email.message_from_bytes(fetch(f"{wheels[-1][1]}.metadata", "*/*"))
    except BenchbotError:
        # One that is gone, or cut off, is no reason to tell nothing of the others: its name is known.
        return Offer(name, kind)
    keywords = [keyword.strip().lower() for keyword in str(metadata["Keywords"] or "").replace(" ", ",").split(",")]
    told = next((KINDS[keyword] for keyword in keywords if keyword in KINDS), "")
    return Offer(name, told or kind, " ".join(str(metadata["Summary"] or "").split()))


def _wheels_with_metadata(text: str, page: str) -> Iterator[tuple[tuple[bool, object], str]]:
    """Yield the wheels of a project whose metadata can be had alone: what they sort by, and their address."""
    for url, has_metadata in _files(text):
        address = urljoin(page, urldefrag(url).url)
        try:
            _, version, _, _ = parse_wheel_filename(address.rpartition("/")[2])
        except InvalidWheelFilename:
            continue
        if has_metadata:
            yield (not version.is_prerelease, version), address


def _files(text: str) -> Iterator[tuple[str, bool]]:
    """Yield the addresses of a project's files, and whether the index has their metadata."""
    if text.lstrip().startswith("{"):
        try:
            files = json.loads(text)["files"]
        except (ValueError, KeyError):
            return
        yield from ((str(one["url"]), bool(one.get("core-metadata") or one.get("dist-info-metadata"))) for one in files)
    else:
        page = _Links()
        page.feed(text)
        yield from page.files


def _project_names(address: str) -> list[str]:
    if not address.startswith(("http://", "https://")):
        raise _not_searchable(address, "It is no http or https address.")
    text = fetch(f"{address.rstrip('/')}/", _ACCEPT).decode("utf-8", "replace")
    if text.lstrip().startswith("{"):
        try:
            return [str(project["name"]) for project in json.loads(text)["projects"]]
        except (ValueError, KeyError, TypeError) as error:
            raise _not_searchable(address, "Its answer is not the list of PEP 691.") from error
    page = _Links()
    page.feed(text)
    if not page.names:
        raise _not_searchable(address, "It offers no list of names.")
    return page.names


def _not_searchable(address: str, why: str) -> BenchbotError:
    title = f"{without_credentials(address)} cannot be searched."
    return BenchbotError(title, why, "Look at its web page, or name another with --index-url URL.")


class _Links(HTMLParser):
    """Collects the links on a page: in PEP 503 their texts are names of projects, or they lead to files."""

    def __init__(self) -> None:
        super().__init__()
        self.names: list[str] = []
        self.files: list[tuple[str, bool]] = []
        self._in_link = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._in_link = tag == "a"
        told = dict(attrs)
        if self._in_link and told.get("href"):
            has_metadata = "data-core-metadata" in told or "data-dist-info-metadata" in told
            self.files.append((str(told["href"]), has_metadata))

    def handle_endtag(self, tag: str) -> None:
        self._in_link = False

    def handle_data(self, data: str) -> None:
        if self._in_link and data.strip():
            self.names.append(data.strip().rstrip("/"))
