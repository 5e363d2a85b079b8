"""Reading declarations and documents: YAML or JSON, checked against JSON Schema, errors with file and line."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from benchbot.core.errors import BenchbotError, did_you_mean

KINDS = (
    "task",
    "robot",
    "environment",
    "format",
    "evaluation_method",
    "ground_truth",
    "example",
    "batch",
    "plan",
    "episodes",
    "result",
    "scores",
    "explanation",
    "comparison",
)

# Not importlib.resources: it takes a tenth of the start-up time of a command that lists names.
_SCHEMAS = Path(__file__).parent.parent / "schemas"
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a file: where, and what."""

    path: Path
    line: int | None
    pointer: str
    message: str

    def __str__(self) -> str:
        line = "" if self.line is None else f":{self.line}"
        where = f" at {self.pointer}" if self.pointer else ""
        return f"{self.path}{line}: {self.message}{where}"


@cache
def schema(kind: str, folder: Path = _SCHEMAS) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a declaration kind or document; plug-ins keep theirs in a `folder`."""
    import json

    document: dict[str, Any] = json.loads((folder / f"{kind}.json").read_text("utf-8"))
    return document


def read(path: Path) -> dict[str, Any]:
    """Return a YAML or JSON file's mapping; raises BenchbotError naming file and line."""
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BenchbotError(
            f"Cannot read {path}.",
            str(error),
            "Check that the path is right and that you may read the file.",
        ) from error
    try:
        document = _parse_json(text, path) if path.suffix == ".json" else yaml.load(text, _Loader)  # noqa: S506
    except ValueError as error:
        # Python refuses integers of more than 4300 digits (sys.set_int_max_str_digits).
        raise BenchbotError(f"{path}: not a usable document.", str(error), "Use numbers of a sensible size.") from error
    except RecursionError as error:
        raise BenchbotError(
            f"{path}: nested too deeply.",
            "The document has more levels than Python can follow.",
            "Use a flat document.",
        ) from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        why = getattr(error, "problem", None) or str(error)
        raise BenchbotError(f"{path}{line}: not valid YAML.", why, "Mend the file at that line.") from error
    if not isinstance(document, dict):
        raise BenchbotError(
            f"{path}: expected a mapping of keys to values.",
            f"The file holds {'nothing' if document is None else 'a ' + type(document).__name__}.",
            "Start with a line such as 'name: my_name'.",
        )
    return document


def _parse_json(text: str, path: Path) -> Any:
    import json

    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        title = f"{path}:{error.lineno}: not valid JSON."
        raise BenchbotError(title, error.msg, "Mend the file at that line.") from error


def problems(document: Any, kind: str, path: Path, folder: Path = _SCHEMAS) -> list[Problem]:
    """Return everything that is wrong with a document, in the order of its lines."""
    from jsonschema import Draft202012Validator

    found = list(_problems(Draft202012Validator(schema(kind, folder)).iter_errors(document), path))
    return sorted(found, key=lambda problem: (problem.line or 0, problem.pointer, problem.message))


def check(document: Any, kind: str, path: Path, folder: Path = _SCHEMAS) -> None:
    """Raise BenchbotError listing everything that is wrong with a document; return when nothing is."""
    wrong = problems(document, kind, path, folder)
    if wrong:
        noun = kind.replace("_", " ")
        raise BenchbotError(
            f"{path} is not a valid {noun}.",
            "\n".join(str(problem) for problem in wrong),
            "Mend the lines above" + (f", then run: benchbot check {path}" if folder == _SCHEMAS else "."),
        )


def _problems(errors: Iterable[Any], path: Path) -> Iterable[Problem]:
    for error in errors:
        keys = list(error.absolute_path)
        if error.validator == "additionalProperties":
            known = sorted(error.schema.get("properties", {}))
            for key in sorted(set(map(str, error.instance)) - set(known)):
                message = f"unknown key '{key}'.{did_you_mean(key, known)} Allowed: {', '.join(known)}"
                yield Problem(path, _line(path, [*keys, key]), _pointer(keys), message)
        elif error.validator == "required":
            missing = [key for key in error.validator_value if key not in error.instance]
            # One error arrives per missing key, in the order of the list; its message quotes the key.
            key = next((key for key in missing if error.message.startswith(f"'{key}'")), missing[0])
            yield Problem(path, _line(path, keys), _pointer(keys), f"the key '{key}' is missing")
        elif error.validator == "enum":
            allowed = [str(value) for value in error.validator_value]
            hint = did_you_mean(str(error.instance), allowed)
            message = f"'{error.instance}' is not allowed here.{hint} Allowed: {', '.join(allowed)}"
            yield Problem(path, _line(path, keys), _pointer(keys), message)
        else:
            yield Problem(path, _line(path, keys), _pointer(keys), _shortened(error.message))


def _shortened(message: str) -> str:
    return message if len(message) <= 200 else f"{message[:120]} … {message[-70:]}"


def _pointer(keys: list[str | int]) -> str:
    return "".join(f"/{key}" for key in keys)


def _line(path: Path, keys: list[str | int]) -> int | None:
    if path.suffix == ".json" or not path.is_file():
        return None
    node: Any = yaml.compose(path.read_text("utf-8"), yaml.SafeLoader)
    line = 1
    for key in keys:
        if isinstance(node, yaml.MappingNode):
            for key_node, value_node in node.value:
                if key_node.value == str(key):
                    line, node = key_node.start_mark.line + 1, value_node
                    break
            else:
                return line
        elif isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
            node = node.value[key]
            line = node.start_mark.line + 1
    return line
