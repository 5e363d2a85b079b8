"""The pages as HTML, for the server and for files; and the scripts, as modules or in one file each."""

import re
import zipfile
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from benchbot.plugin import BenchbotError
from benchbot.viewing import DARK, LIGHT, to_hex

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "frame-src 'self'; base-uri 'none'; form-action 'none'"
)
STATIC = Path(__file__).parent / "static"
_IMPORT = re.compile(r'^import \{[^}]*\} from "\./([\w-]+\.js)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?function|const|class)", re.MULTILINE)
_THREE = re.compile(rb"<script>(.*?THREE\.TrackballControls=TrackballControls;\}\)\(\);)", re.DOTALL)


@cache
def _templates() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["data"] = data
    environment.filters["number"] = lambda value: "–" if value is None else f"{value:.3f}"
    return environment


def data(document: Any) -> Markup:
    """Return a document as JSON for a block of data in a page: nothing in it ends the block."""
    text = msgspec.json.encode(document).decode()
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))  # noqa: S704 - escaped


def page(name: str, *, is_static: bool = False, root: str = "", **values: Any) -> str:
    """Return a page; `root` leads from it to the index. A static one needs no server."""
    return _templates().get_template(name).render(is_static=is_static, root=root, policy=POLICY, **values)


def style() -> str:
    """Return the style sheet, in the colours of reports and maps."""
    return _templates().get_template("style.css").render(light=_hex(LIGHT), dark=_hex(DARK))


def _hex(palette: Any) -> Mapping[str, str]:
    return {name: to_hex(getattr(palette, name)) for name in palette.__dataclass_fields__}


def bundle(entry: str) -> str:
    """Return a script and what it imports as one classic script: a page from a disk may not load modules."""
    parts: dict[str, str] = {}

    def add(name: str) -> None:
        if name in parts:
            return
        parts[name] = ""  # it keeps its place behind what it imports
        text = (STATIC / name).read_text("utf-8")
        for imported in _IMPORT.findall(text):
            add(imported)
        del parts[name]
        parts[name] = _EXPORT.sub("", _IMPORT.sub("", text))

    add(entry)
    return '"use strict";\n(() => {\n' + "\n".join(parts.values()) + "})();\n"


@cache
def three() -> bytes:
    """Return three.js, with TrackballControls, as trimesh has it in the page of its own viewer.

    Raises BenchbotError for a release of trimesh that keeps it elsewhere.
    """
    try:
        archive = files("trimesh") / "resources" / "templates" / "viewer.zip"
        with archive.open("rb") as stream, zipfile.ZipFile(stream) as opened:
            found = _THREE.search(opened.read("viewer.html.template"))
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise _no_three(str(error)) from error
    if found is None:
        raise _no_three("Its viewer's page is another one.")
    return found[1]


def _no_three(why: str) -> BenchbotError:
    return BenchbotError(
        "There is no three.js to draw in three dimensions with.", why, "Install a trimesh as constraints.txt has it."
    )
