"""What is wrong with a built site: links and anchors that lead nowhere, and whatever it would load from other hosts."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

_ITEM = re.compile(r"- |\| ")
_LOADS = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}


@dataclass
class _Page:
    anchors: set[str] = field(default_factory=set)
    links: list[str] = field(default_factory=list)
    loads: list[str] = field(default_factory=list)
    raw_markdown: list[str] = field(default_factory=list)


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.page = _Page()
        self._code = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.page.anchors |= {value for key in ("id", "name") if (value := values.get(key))}
        if tag == "a" and (link := values.get("href")):
            self.page.links.append(link)
        if tag in _LOADS and (load := values.get(_LOADS[tag])) and values.get("rel") != "canonical":
            self.page.loads.append(load)
        self._code += tag in {"code", "pre", "script", "style"}

    def handle_endtag(self, tag: str) -> None:
        self._code -= tag in {"code", "pre", "script", "style"}

    def handle_data(self, data: str) -> None:
        # Markdown that was not understood: GitHub's dialect is more lenient than Python-Markdown's.
        if not self._code and ("```" in data or any(map(_ITEM.match, data.splitlines()[1:]))):
            self.page.raw_markdown.append(data.strip()[:80])


def problems(site: Path) -> list[str]:
    """Return what is wrong with the pages of a site, each as `page: what`; nothing when all is well."""
    pages = {path: _read(path) for path in sorted(site.rglob("*.html"))}
    return [f"{path.relative_to(site)}: {problem}" for path in pages for problem in _of(path, pages, site)]


def _read(path: Path) -> _Page:
    reader = _Reader()
    reader.feed(path.read_text("utf-8"))
    return reader.page


def _of(path: Path, pages: dict[Path, _Page], site: Path) -> Iterator[str]:
    yield from (f"Markdown that was not understood: {text}" for text in pages[path].raw_markdown)
    for load in pages[path].loads:
        if urlsplit(load).netloc:
            yield f"loads from another host: {load}"
    for link in pages[path].links + pages[path].loads:
        parts = urlsplit(link)
        if parts.scheme or parts.netloc or path.name == "404.html":
            continue
        there = (path.parent / unquote(parts.path)).resolve() if parts.path else path
        there = there / "index.html" if there.is_dir() else there
        if not there.is_file():
            yield f"leads nowhere: {link}"
        elif parts.fragment and there in pages and not _has(pages[there], unquote(parts.fragment)):
            yield f"leads to no such heading: {link}"


def _has(page: _Page, anchor: str) -> bool:
    return anchor in page.anchors or anchor.startswith("__")
