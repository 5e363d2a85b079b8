"""The pages of the site, gathered from all over the repository, with links that lead to one another.

In the repository a page links to files beside it: other pages, READMEs, sources. On the site READMEs are pages of their
own, and so is each source that a page links to: the site needs no other host, and a link to nothing is an error.
"""

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from docs.tools import links, notebook

_LANGUAGES = {".py": "python", ".yaml": "yaml", ".yml": "yaml", ".json": "json", ".toml": "toml", ".sh": "bash"}
_NOT_PAGES = {"tools", "zensical.toml", "__pycache__"}


class BrokenLinksError(Exception):
    """Links that lead to nothing, each as `page: target`."""


@dataclass
class _Site:
    root: Path
    folder: Path
    pages: dict[str, str] = field(default_factory=dict)
    """Path in the repository to path on the site."""
    broken: list[str] = field(default_factory=list)


def stage(root: Path, folder: Path) -> None:
    """Write all pages, and the pictures that they show, into a new folder.

    Raises BrokenLinksError for links to files that there are not.
    """
    site = _Site(root, folder)
    site.pages |= {"README.md": "index.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
    for readme in sorted(root.glob("plugins/*/README.md")):
        name = readme.parent.name
        site.pages |= dict.fromkeys((f"plugins/{name}/README.md", f"plugins/{name}"), f"distributions/{name}.md")
    for path in _files(root / "docs"):
        inside = path.relative_to(root / "docs")
        site.pages[f"docs/{inside.as_posix()}"] = inside.with_suffix(
            ".md" if path.suffix == ".ipynb" else path.suffix
        ).as_posix()

    written = {"index.md"}  # docs/index.md, not the README, is the site's first page
    for source, target in list(site.pages.items()):
        if (target in written and source != "docs/index.md") or (root / source).is_dir():
            continue
        written.add(target)
        _write(site, source, target)
    if site.broken:
        raise BrokenLinksError("\n".join(sorted(site.broken)))


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.iterdir()):
        if path.name in _NOT_PAGES:
            continue
        if path.is_dir() and path.name != "examples":
            yield from _files(path)
        elif path.is_file():
            yield path


def _write(site: _Site, source: str, target: str) -> None:
    path, place = site.root / source, site.folder / target
    place.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix not in {".md", ".ipynb"}:
        shutil.copyfile(path, place)
        return
    text = notebook.as_markdown(path) if path.suffix == ".ipynb" else path.read_text("utf-8")
    place.write_text(links.rewritten(text, lambda link: _link(site, source, target, link)), "utf-8")


def _link(site: _Site, source: str, target: str, link: str) -> str:
    """Return where a link of the page from `source`, which is at `target` on the site, leads there."""
    name, hash_sign, anchor = link.partition("#")
    there = os.path.normpath(PurePosixPath(source).parent / name)
    if there not in site.pages:
        if not (site.root / there).exists() or there.startswith(".."):
            site.broken.append(f"{source}: {link}")
            return link
        site.pages[there] = f"source/{there}.md"
        place = site.folder / site.pages[there]
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(_source_page(site.root, there), "utf-8")
    return os.path.relpath(site.pages[there], PurePosixPath(target).parent) + hash_sign + anchor


def _source_page(root: Path, name: str) -> str:
    """Return a page that shows a source file, or all files of a folder."""
    path = root / name
    files = sorted(item for item in path.rglob("*") if item.is_file()) if path.is_dir() else [path]
    shown = [item for item in files if "__pycache__" not in item.parts]
    if not path.is_dir():
        return f"# {path.name}\n\n`{name}`\n\n{_code(path)}"
    return f"# {name}\n\n" + "\n".join(f"## {item.relative_to(path).as_posix()}\n\n{_code(item)}" for item in shown)


def _code(path: Path) -> str:
    return f"````{_LANGUAGES.get(path.suffix, 'text')}\n{path.read_text('utf-8').rstrip()}\n````\n"
