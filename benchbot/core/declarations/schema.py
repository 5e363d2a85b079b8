"""Reading declarations and documents: YAML or JSON, checked against JSON Schema, errors with file and line.

Editors such as VS Code, Vim and Emacs complete a declaration whose first line names a schema, as the YAML language
server reads it: https://github.com/redhat-developer/yaml-language-server#using-inlined-schema
"""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from benchbot.core.errors import BenchbotError
from benchbot.core.findings import Problem

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
    "bundle",
    "recording",
    "challenge",
)

# Not importlib.resources: it takes a tenth of the start-up time of a command that lists names.
_SCHEMAS = Path(__file__).parents[2] / "schemas"
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
MOST_VALUES = 1_000_000
_YAML_HINTS = {
    "cannot start any token": " Indent with spaces, never tabs, and put text that begins with @ or ` in quotes.",
    "mapping values are not allowed": " Put text with a colon and a space in quotes, and indent keys alike.",
    "could not find expected ':'": " Each key is followed by a colon and a space.",
    "did not find expected key": " Keys of one mapping are indented alike; see that each quote and bracket is closed.",
    "did not find expected ',' or": " A bracket is not closed, or a comma is missing.",
    "did not find expected '-' indicator": " Items of one list are indented alike, each after a hyphen and a space.",
    "unexpected end of stream": " A quote is not closed.",
    "could not determine a constructor": " Tags such as !!python are not allowed.",
    "found another document": " Write each declaration into a file of its own.",
    "undefined alias": " A value that begins with * stands for an anchor (&); put the text in quotes.",
}


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
            f"It is not text in UTF-8: {error}" if isinstance(error, UnicodeDecodeError) else str(error),
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
        raise BenchbotError(
            f"{path}{line}: not valid YAML.", _why_no_yaml(error), "Mend the file at that line."
        ) from error
    if "&" in text and "*" in text and _is_endless(document):
        raise BenchbotError(
            f"{path}: too much is repeated by anchors (&) and aliases (*).",
            f"Written out, it would have more than {MOST_VALUES:,} values.",
            "Write it out, or leave it out.",
        )
    if not isinstance(document, dict):
        raise BenchbotError(
            f"{path}: expected a mapping of keys to values.",
            f"The file holds {'nothing' if document is None else 'a ' + type(document).__name__}.",
            "Start with a line such as 'name: my_name'.",
        )
    return document


def _why_no_yaml(error: yaml.YAMLError) -> str:
    problem, context = getattr(error, "problem", None), getattr(error, "context_mark", None)
    if not problem:
        return str(error)
    what = getattr(error, "context", None)
    begun = f", {what} in line {context.line + 1}" if context and what and "next token" not in what else ""
    hint = next((hint for part, hint in _YAML_HINTS.items() if part in problem), "")
    return f"{problem}{begun}.{hint}"


def _is_endless(document: Any) -> bool:
    """Say whether a document has more values than can be checked: ten lines of YAML can stand for billions."""
    count, left = 0, [document]
    while left and count <= MOST_VALUES:
        value = left.pop()
        count += 1
        if isinstance(value, dict | list):
            left += value.values() if isinstance(value, dict) else value
    return count > MOST_VALUES


def _parse_json(text: str, path: Path) -> Any:
    import json

    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        title = f"{path}:{error.lineno}: not valid JSON."
        raise BenchbotError(title, error.msg, "Mend the file at that line.") from error


def problems(document: Any, kind: str, path: Path, folder: Path = _SCHEMAS) -> list[Problem]:
    """Return everything that is wrong with a document, in the order of its lines."""
    from benchbot.core.declarations.problems import of

    found = of(document, schema(kind, folder), path)
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


EDITOR_FOLDER = ".schemas"
"""The folder of schemas that is written beside declarations for editors."""


def editor_line(kind: str, up: int = 1) -> str:
    """Return the first line of a declaration that is `up` folders below the one that holds `EDITOR_FOLDER`."""
    return f"# yaml-language-server: $schema={'../' * up}{EDITOR_FOLDER}/{kind}.json\n"


def write_editor_schema(folder: Path, *kinds: str) -> None:
    """Write schemas for editors into a folder of declarations; raises OSError when they cannot be written."""
    write_schemas(folder / EDITOR_FOLDER, {kind: schema(kind) for kind in kinds})


def write_schemas(folder: Path, schemas: Mapping[str, dict[str, Any]]) -> list[Path]:
    """Write schemas into a folder, by kind, and return their files; raises OSError when they cannot be written."""
    import json

    from benchbot.core import atomic

    paths = [folder / f"{kind}.json" for kind in schemas]
    for path, document in zip(paths, schemas.values(), strict=True):
        atomic.write(path, (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode())
    return paths
