"""What becomes of a folder of v2's add-ons here: of each declaration a verdict and why, and what the add-ons need."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import KINDS, Catalog, name_of
from benchbot.core.errors import BenchbotError
from benchbot.core.resources import declaration_files
from benchbot.plugins.v2 import addons, official
from benchbot.plugins.v2.addons import Addon
from benchbot.plugins.v2.code import REQUIREMENTS

DEPENDENCIES, REMOTE = ".dependencies", ".remote"
SCHEMAS = {kind: KINDS.get(kind, kind.removesuffix("s")) for kind in addons.KINDS}
_UNCOMPARED = {"name", "description", "type", "_file_path", "map_path"}


class Verdict(StrEnum):
    """What becomes of a declaration."""

    RUNS = "runs"
    SHIPPED = "shipped"
    """A plug-in has it: that one is used."""
    REPLACED = "replaced"
    """It needs what v2 ran it on; something else takes its place."""
    CLASHES = "clashes"
    WILL_NOT_RUN = "will not run"


USABLE = (Verdict.RUNS, Verdict.SHIPPED, Verdict.REPLACED)


Here = Mapping[str, tuple[str, Mapping[str, Any] | None]]
"""The things of a kind that there are without the folder, by name: whose they are, and what they say if it counts."""


@dataclass(frozen=True)
class Row:
    """A declaration of a folder, its verdict and why."""

    kind: str
    name: str
    verdict: Verdict
    why: str
    path: Path


@dataclass(frozen=True)
class Folder:
    """The declarations of a folder by kind and name, and those that cannot be read."""

    addon: Addon
    declared: Mapping[str, Mapping[str, tuple[dict[str, Any], Path]]]
    broken: Sequence[Row]


def read(addon: Addon) -> Folder:
    """Read all declarations of a folder, the official ones too."""
    declared: dict[str, dict[str, tuple[dict[str, Any], Path]]] = {kind: {} for kind in SCHEMAS}
    broken = []
    for kind, schema_name in SCHEMAS.items():
        suffixes = (".json",) if kind == "ground_truths" else (".yaml", ".yml")
        for path in declaration_files(addon.sources(kind), suffixes):
            try:
                data = {key: value for key, value in schema.read(path).items() if key != "_file_path"}
                schema.check(data, schema_name, path)
                name = _truth_name(data) if kind == "ground_truths" else name_of(kind, data, path)
            except BenchbotError as error:
                broken.append(Row(kind, path.name, Verdict.WILL_NOT_RUN, f"{error.title} {error.why}", path))
            else:
                declared[kind].setdefault(name, (data, path))
    return Folder(addon, declared, broken)


def judged(folder: Folder, catalog: Catalog) -> list[Row]:
    """Return the verdict on each declaration; `catalog` is what there is without the folder."""
    rows: list[Row] = []
    for kind, things in folder.declared.items():
        here = _here(catalog, kind) if things else {}
        rows += [_row(folder, catalog, here, kind, name, data, path) for name, (data, path) in things.items()]
    return [*rows, *folder.broken]


def needs(folder: Folder, distributions: set[str]) -> Iterator[str]:
    """Yield what the add-ons of a folder ask for beside: other add-ons, Python packages, content that is not in git."""
    root = folder.addon.root
    for name in sorted({name for path in _files(root, DEPENDENCIES) for name in _lines(path)}):
        yield f"{name}: {_dependency(name, root, distributions)}"
    for path in sorted(_files(root, REQUIREMENTS)):
        yield f"Python packages of {path.parent.name}: pip install -r {path}"
    for path in sorted(_files(root, REMOTE)):
        url, _, target = next(_lines(path), "").partition(" ")
        there = path.parent / target.strip()
        content = any(there.iterdir()) if target and there.is_dir() else False
        repository = official.repository(path.parent, root)
        if repository is not None and official.is_installed(repository, distributions):
            yield f"Remote content of {path.parent.name}: not needed, what ships replaces it"
        else:
            where = f"not there: download {url} and unpack it into {there}"
            yield f"Remote content of {path.parent.name}: {'there' if content else where}"


def dependencies(root: Path) -> list[str]:
    """Return the add-ons that those in a folder name as needed, and that are not in it themselves."""
    named = {name for path in _files(root, DEPENDENCIES) for name in _lines(path)}
    return sorted(name for name in named if not _is_in(root, name))


def url_of(name: str) -> str:
    """Return the address of an add-on that is named as v2 does: `user/repository`, or its whole URL."""
    return name if "://" in name else f"https://github.com/{name}"


def _row(folder: Folder, catalog: Catalog, here: Here, kind: str, name: str, data: dict[str, Any], path: Path) -> Row:
    repository = official.repository(path.parent, folder.addon.root)
    theirs = None if repository is None else official.REPLACED[repository]
    if name in here and theirs is not None:
        differing = _differences(data, here[name][1])
        why = "; ".join(filter(None, [f"by {here[name][0]}", theirs.differs, differing]))
        return Row(kind, name, Verdict.SHIPPED, why, path)
    if name in here:
        fix = f"{here[name][0]} has one of that name: rename yours, or leave out its file"
        return Row(kind, name, Verdict.CLASHES, fix, path)
    missing = _MISSING[kind](folder, catalog, data, path)
    if missing and theirs is not None and kind in ("robots", "environments"):
        return Row(
            kind, name, Verdict.REPLACED, f"{missing}; {', '.join(theirs.distributions)}: {theirs.differs}", path
        )
    code = "its code needs --trust-addons" if kind in ("formats", "evaluation_methods") else ""
    return Row(kind, name, Verdict.WILL_NOT_RUN if missing else Verdict.RUNS, missing or code, path)


def _here(catalog: Catalog, kind: str) -> Here:
    """Return who has the things of a kind, by name, and what they say."""
    if kind == "evaluation_methods":
        found = catalog.plugins.pool("evaluators").items()
        return {name: (provided.distribution, None) for name, provided in found}
    if kind == "ground_truths":
        documents = (schema.read(path) for path in catalog.ground_truth_files)
        return {_truth_name(data): ("a plug-in", None) for data in documents}
    code = kind in ("formats", "examples", "robots", "environments")
    return {name: (one.distribution, None if code else one.data) for name, one in catalog.pool(kind).items()}


def _differences(theirs: Mapping[str, Any], ours: Mapping[str, Any] | None) -> str:
    """Return the keys in which a declaration says something else, in words; those of v2 have defaults."""
    if ours is None:
        return ""
    said = [{"localisation": "ground_truth", "scene_count": 1, **each} for each in (theirs, ours)]
    keys = sorted(key for key in theirs.keys() - _UNCOMPARED if _plain(said[0][key]) != _plain(said[1].get(key)))
    return f"says otherwise: {', '.join(keys)}" if keys else ""


def _plain(value: Any) -> Any:
    return sorted(map(str, value)) if isinstance(value, list) else value


def _format_is_missing(folder: Folder, catalog: Catalog, data: Mapping[str, Any], path: Path) -> str:
    name = data.get("results_format")
    known = name is None or name in catalog.pool("formats") or name in folder.declared["formats"]
    return "" if known else f"there is no format '{name}'"


def _formats_are_missing(folder: Folder, catalog: Catalog, data: Mapping[str, Any], path: Path) -> str:
    known = {*catalog.pool("formats"), *folder.declared["formats"]}
    lacking = sorted({*data["valid_result_formats"], *data["valid_ground_truth_formats"]} - known)
    return f"there is no format '{lacking[0]}'" if lacking else _code_is_missing(folder, catalog, data, path)


def _code_is_missing(folder: Folder, catalog: Catalog, data: Mapping[str, Any], path: Path) -> str:
    modules = sorted({target.replace(":", ".").rpartition(".")[0] for target in data["functions"].values()})
    lacking = [name for name in modules if not (path.parent / f"{name.replace('.', '/')}.py").is_file()]
    return f"there is no {lacking[0]}.py beside it" if lacking else ""


def _type_is_missing(folder: Folder, catalog: Catalog, data: Mapping[str, Any], path: Path) -> str:
    runs = {*catalog.plugins.pool("simulators"), *catalog.plugins.pool("robot_drivers")}
    kind = data["type"]
    return "" if kind in runs else f"nothing here runs type '{kind}', its maps and commands are v2's"


def _scenes_are_missing(folder: Folder, catalog: Catalog, data: Mapping[str, Any], path: Path) -> str:
    known = {*catalog.pool("environments"), *folder.declared["environments"]}
    scenes = [
        f"{name}:{variant}"
        for name, *variants in (str(each).split(":") for each in data["environments"])
        for variant in variants
    ]
    lacking = [scene for scene in scenes if scene not in known]
    return f"there is no environment '{lacking[0]}'" if lacking else ""


def _scene_is_missing(folder: Folder, catalog: Catalog, data: Mapping[str, Any], path: Path) -> str:
    name = _scene_of(data)
    known = name in catalog.pool("environments") or name in folder.declared["environments"]
    return "" if known else f"there is no environment '{name}'"


def _program_is_missing(folder: Folder, catalog: Catalog, data: Mapping[str, Any], path: Path) -> str:
    program, *words = data["native_command"].split()
    files = [word for word in words if "/" in word and not word.startswith("-")]
    lacking = [word for word in files[:1] if not (path.parent / word).exists()]
    return f"there is no {lacking[0]} beside it, which {program} is to run" if lacking else ""


_MISSING: Mapping[str, Callable[[Folder, Catalog, Mapping[str, Any], Path], str]] = {
    "batches": _scenes_are_missing,
    "environments": _type_is_missing,
    "evaluation_methods": _formats_are_missing,
    "examples": _program_is_missing,
    "formats": _code_is_missing,
    "ground_truths": _scene_is_missing,
    "robots": _type_is_missing,
    "tasks": _format_is_missing,
}
"""Functions that say what a declaration lacks here, in words; an empty text when it lacks nothing."""


def _scene_of(data: Mapping[str, Any]) -> str:
    return f"{data['environment']['name']}:{data['environment']['variant']}"


def _truth_name(data: Mapping[str, Any]) -> str:
    return f"{_scene_of(data)} ({data['format']['name']})"


def _dependency(name: str, root: Path, distributions: set[str]) -> str:
    replacement = official.replacement_of(name)
    if replacement is not None:
        lacking = [each for each in replacement.distributions if each not in {*distributions, "benchbot"}]
        shipped = f"ships as {', '.join(replacement.distributions)}"
        return f"{shipped}: benchbot install {' '.join(lacking)}" if lacking else shipped
    return "is in this folder" if _is_in(root, name) else f"is not here: benchbot install {url_of(name)}"


def _is_in(root: Path, name: str) -> bool:
    place = name.removesuffix(".git").split("/")[-2:]
    folders = (path for path in [root, *root.glob("**/*")] if path.is_dir() and ".git" not in path.parts)
    return any([path.parent.name, path.name] == place for path in folders)


def _files(root: Path, name: str) -> Iterator[Path]:
    return (path for path in root.glob(f"**/{name}") if path.is_file() and ".git" not in path.parts)


def _lines(path: Path) -> Iterator[str]:
    lines = (line.partition("#")[0].strip() for line in path.read_text("utf-8", "replace").splitlines())
    return (line for line in lines if line)
