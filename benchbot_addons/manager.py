"""The import name of BenchBot v2: what there is, by type; thin aliases of the catalog.

Add-ons are found as everywhere: installed, or named by `BENCHBOT_ADDONS`. Where v2 returned None or raised TypeError
for a name that is not there, `get_match` returns None and the others raise BenchbotError. What installed add-ons is
`benchbot install`.
"""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchbot.core.declarations.catalog import Catalog, Declaration
from benchbot.core.errors import BenchbotError, did_you_mean

SUPPORTED_TYPES = [
    "batches",
    "environments",
    "evaluation_methods",
    "examples",
    "formats",
    "ground_truths",
    "robots",
    "tasks",
]
KEY_FILE_PATH = "_file_path"

FileName = str | os.PathLike[str]


def env_name(env_string: str) -> str:
    """Return the name in `name:variant`."""
    return env_string.rpartition(":")[0] or env_string


def env_variant(env_string: str) -> str:
    """Return the variant in `name:variant`."""
    return env_string.rpartition(":")[2]


def env_string(envs_data: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> str:
    """Return `name:variant[:variant…]` of an environment, or of the scenes of one."""
    scenes = [envs_data] if isinstance(envs_data, Mapping) else envs_data
    return ":".join([str(scenes[0]["name"]), *(str(scene["variant"]) for scene in scenes)])


def exists(type_string: str, name_value_tuples: Iterable[tuple[str, Any]]) -> bool:
    """Say whether there is something of a type with these values."""
    return get_match(type_string, name_value_tuples) is not None


def find_all(type_string: str, extension: str = "ya?ml") -> list[str]:
    """Return the files that declare things of a type; raises BenchbotError for an unknown type."""
    return [str(path) for path in _files(type_string)]


def get_match(
    type_string: str, name_value_tuples: Iterable[tuple[str, Any]], return_data: bool = False
) -> str | dict[str, Any] | None:
    """Return the file of the first thing of a type with these values, or its data; None when there is none."""
    wanted = [(name, str(value)) for name, value in name_value_tuples]
    for path in _files(type_string):
        data = load_yaml(path)
        if all(str(data.get(name)) == value for name, value in wanted):
            return data if return_data else str(path)
    return None


def get_field(type_string: str, field_name: str) -> list[Any]:
    """Return a field of everything of a type; None where it is absent."""
    return [get_value(path, field_name) for path in _files(type_string)]


def get_fields(type_string: str, field_names: Sequence[str]) -> list[list[Any]]:
    """Return some fields of everything of a type; None where one is absent."""
    return [[get_value(path, name) for name in field_names] for path in _files(type_string)]


def get_value(filename: FileName, field_name: str) -> Any:
    """Return a field of a file; None when it is absent."""
    return load_yaml(filename).get(field_name)


def get_value_by_name(type_string: str, name: str, field_name: str) -> Any:
    """Return a field of the thing of this name; raises BenchbotError when there is none."""
    wanted = [("name", name)]
    if type_string == "environments":
        wanted = [("name", env_name(name)), ("variant", env_variant(name))]
    found = get_match(type_string, wanted)
    if not isinstance(found, str):
        names = [str(each) for each in get_field(type_string, "name")]
        raise BenchbotError(
            f"There is nothing called '{name}' among the {type_string}.",
            f"There are: {', '.join(dict.fromkeys(names)) or 'none'}.{did_you_mean(name, names)}",
            "Name one of these, or the folder of add-ons that has it: BENCHBOT_ADDONS=FOLDER",
        )
    return get_value(found, field_name)


def load_functions(data: Mapping[str, Any], key: str = "functions") -> dict[str, Callable[..., Any]]:
    """Return the functions that a format declares; raises BenchbotError for code of add-ons that is not trusted."""
    from benchbot.core.declarations import formats

    if key not in data:
        return {}
    declared = _catalog().get("formats", str(data["name"]))
    return formats.functions(declared)


def load_yaml(filename: FileName) -> dict[str, Any]:
    """Return the content of a declaration, and its path as `_file_path`; raises BenchbotError."""
    from benchbot.core.declarations import schema

    return {KEY_FILE_PATH: str(filename), **schema.read(Path(filename))}


def load_yaml_list(filenames_list: Iterable[FileName]) -> list[dict[str, Any]]:
    """Return the content of several declarations."""
    return [load_yaml(filename) for filename in filenames_list]


def _catalog() -> Catalog:
    from benchbot.core.plugin_manager import load

    return Catalog(load())


def _files(type_string: str) -> list[Path]:
    if type_string not in SUPPORTED_TYPES:
        raise BenchbotError(
            f"'{type_string}' is no type of add-ons.",
            f"There are: {', '.join(SUPPORTED_TYPES)}.{did_you_mean(type_string, SUPPORTED_TYPES)}",
            "Name one of these.",
        )
    catalog = _catalog()
    if type_string == "ground_truths":
        return list(catalog.ground_truth_files)
    if type_string == "evaluation_methods":
        from benchbot.core.resources import declaration_files
        from benchbot.plugins.v2 import addons

        folders = [folder for addon in addons.from_environment() for folder in addon.sources(type_string)]
        return list(declaration_files(folders))
    pool: Iterable[Declaration] = catalog.pool(type_string).values()
    return [each.path for each in pool]
