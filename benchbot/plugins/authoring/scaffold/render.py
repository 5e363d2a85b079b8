"""Projects from templates: files beside this one, whose paths and texts are filled in."""

import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.errors import BenchbotError
from benchbot.plugins.authoring.scaffold.kinds import KINDS, Kind
from benchbot.plugins.authoring.scaffold.naming import package_of

_TEMPLATES = Path(__file__).parent / "templates"
_SUFFIX = ".j2"


def create(kind: str, name: str, parent: Path) -> Path:
    """Write a new project of a kind into the folder `parent / name`, and return it; it is there whole or not at all.

    Raises BenchbotError for a name that cannot be, for a folder that exists and for one that cannot be written.
    """
    chosen = KINDS[kind]
    package = package_of(name)
    target = parent / name
    if target.exists() or target.is_symlink():
        raise BenchbotError(
            f"{target} is there already.",
            "Nothing is ever overwritten.",
            "Choose another name, or another folder with --output-location.",
        )
    try:
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=parent, prefix=f".{name}-") as temporary:
            folder = Path(temporary) / name
            _write(folder, chosen, name, package)
            folder.rename(target)
    except OSError as error:
        raise BenchbotError(
            f"{target} cannot be written.",
            f"{error.strerror or error}.",
            "Name a folder that you may write to with --output-location.",
        ) from error
    return target


def files_of(kind: Kind, name: str, package: str) -> Iterator[tuple[Path, str]]:
    """Yield the path of each file in the project, and its text."""
    from jinja2 import Environment, StrictUndefined

    # Not the usual braces: Python, YAML and the language of CI files have those, too.
    # Nothing is escaped: what is made is source code, and names are checked.
    environment = Environment(  # noqa: S701
        variable_start_string="<<",
        variable_end_string=">>",
        block_start_string="<%",
        block_end_string="%>",
        keep_trailing_newline=True,
        trim_blocks=True,
        undefined=StrictUndefined,
    )
    values = _values(kind, name, package)
    for root in (_TEMPLATES / "common", _TEMPLATES / kind.name):
        for template in sorted(root.rglob(f"*{_SUFFIX}")):
            relative = str(template.relative_to(root)).removesuffix(_SUFFIX)
            path = Path(relative.replace("PACKAGE", package).replace("dot_", "."))
            yield path, environment.from_string(template.read_text("utf-8")).render(values)
    for declared in kind.schemas:
        text = json.dumps(schema.schema(declared), indent=2, ensure_ascii=False) + "\n"
        yield Path(".schemas") / f"{declared}.json", text


def _values(kind: Kind, name: str, package: str) -> Mapping[str, Any]:
    return {
        "name": name,
        "package": package,
        "summary": kind.summary,
        "dependencies": kind.dependencies,
        "commands": [command.format(package=package) for command in kind.commands],
        "places": [(path.format(package=package), what) for path, what in kind.places],
    }


def _write(folder: Path, kind: Kind, name: str, package: str) -> None:
    for path, text in files_of(kind, name, package):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    # A temporary folder is private; a project is as readable as any other folder of the user.
    shutil.copymode(folder / "src", folder)
