"""Lines of values in YAML and JSON files, found by the keys that lead to them."""

import json
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import yaml

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_SPACE = re.compile(r"[ \t\r\n]*")
_DECODER = json.JSONDecoder()

Keys = Sequence[str | int]


class Positions:
    """The lines of a file that has been read without an error; None for each where there is no such file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._is_json = path.suffix == ".json"

    @cached_property
    def _text(self) -> str:
        return self._path.read_text("utf-8") if self._path.is_file() else ""

    @cached_property
    def _root(self) -> Any:
        return None if self._is_json or not self._text else yaml.compose(self._text, _Loader)

    def line(self, keys: Keys) -> int | None:
        """Return the line, from 1, where the value of `keys` begins, or what is nearest to it of what is there."""
        if not self._text:
            return None
        if self._is_json:
            return self._text.count("\n", 0, _json_offset(self._text, keys)) + 1
        return _yaml_line(self._root, keys)

    def written(self, keys: Keys) -> str | None:
        """Return a YAML scalar as it is written, where BenchBot reads something else than text from it."""
        node = self._root
        for key in keys:
            _, node = _child(node, key)
        return node.value if isinstance(node, yaml.ScalarNode) else None

    def repeated(self) -> Iterator[tuple[list[str | int], str, int, int]]:
        """Yield keys that a mapping of YAML has twice: those that lead to it, the key, its first and its other line."""
        yield from _repeated(self._root, [], set())


def _yaml_line(node: Any, keys: Keys) -> int:
    line = 1
    for key in keys:
        begins, node = _child(node, key)
        if begins is None:
            break
        line = begins
    return line


def _child(node: Any, key: str | int) -> tuple[int | None, Any]:
    """Return the line and the node of a value in a mapping or a list; nothing where there is none."""
    if isinstance(node, yaml.MappingNode):
        # The last of two with the same key is the one that counts.
        for key_node, value_node in reversed(node.value):
            if key_node.value == str(key) or _constructed(key_node) == str(key):
                return key_node.start_mark.line + 1, value_node
    elif isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
        return node.value[key].start_mark.line + 1, node.value[key]
    return None, None


def _constructed(node: Any) -> str:
    """Return a key as it reads, where that is not as it is written: `on` is true."""
    if not isinstance(node, yaml.ScalarNode) or node.tag in ("tag:yaml.org,2002:str", "tag:yaml.org,2002:merge"):
        return ""
    return str(yaml.SafeLoader("").construct_object(node))


def _repeated(node: Any, keys: list[str | int], seen: set[int]) -> Iterator[tuple[list[str | int], str, int, int]]:
    if id(node) in seen:  # an alias: it may even hold itself
        return
    seen.add(id(node))
    if isinstance(node, yaml.SequenceNode):
        for index, item in enumerate(node.value):
            yield from _repeated(item, [*keys, index], seen)
    elif isinstance(node, yaml.MappingNode):
        first: dict[str, int] = {}
        for key_node, value_node in node.value:
            key, line = str(key_node.value), key_node.start_mark.line + 1
            if key in first and key != "<<":
                yield keys, key, first[key], line
            first.setdefault(key, line)
            yield from _repeated(value_node, [*keys, key], seen)


def _json_offset(text: str, keys: Keys) -> int:
    """Return where a value begins, or its key if it has one; the standard decoder skips what is on the way."""
    begin = value = _after_space(text, 0)
    for key in keys:
        found = _json_child(text, value, key)
        if found is None:
            break
        begin, value = found
    return begin


def _json_child(text: str, begin: int, key: str | int) -> tuple[int, int] | None:
    """Return where the key and where the value begin in the object or array that begins at `begin`."""
    named = text[begin] == "{"
    if text[begin] not in "{[" or named != isinstance(key, str):
        return None
    found, index, position = None, 0, _after_space(text, begin + 1)
    while text[position] not in "}]":
        name: str | int = index
        start = position
        if named:
            name, position = _DECODER.raw_decode(text, position)
            position = _after_space(text, _after_space(text, position) + 1)
        if name == key:
            found = start, position
        _, position = _DECODER.raw_decode(text, position)
        position = _after_space(text, position)
        if text[position] == ",":
            position = _after_space(text, position + 1)
        index += 1
    return found


def _after_space(text: str, position: int) -> int:
    match = _SPACE.match(text, position)
    return match.end() if match else position
