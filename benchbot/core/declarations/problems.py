"""Violations of a JSON Schema, in words for the author of the document."""

from collections.abc import Iterable, Iterator
from contextlib import suppress
from datetime import date
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator

from benchbot.core.declarations.positions import Positions
from benchbot.core.errors import did_you_mean
from benchbot.core.findings import Problem

MOST_NAMES = 40
MOST_ALIKE = 3
_MOST_LETTERS = 200


def of(document: Any, schema: dict[str, Any], path: Path) -> Iterator[Problem]:
    """Yield everything that is wrong with a document, in no order."""
    alike: dict[tuple[Any, ...], list[Any]] = {}
    for error in Draft202012Validator(schema).iter_errors(document):
        alike.setdefault((*error.absolute_schema_path, len(error.absolute_path)), []).append(error)
    if not alike:
        return
    positions = Positions(path)
    for errors in alike.values():
        # Of a list whose every item is wrong in one way, the first few say it.
        several = len({tuple(error.absolute_path) for error in errors}) > MOST_ALIKE
        for error in errors[:MOST_ALIKE] if several else errors:
            yield from _problems(error, path, positions)
        if several:
            keys = list(errors[MOST_ALIKE].absolute_path)
            message = f"and {len(errors) - MOST_ALIKE} more like those before, the first of them here"
            yield Problem(path, positions.line(keys), pointer(keys), message)


def pointer(keys: Iterable[str | int]) -> str:
    """Return the JSON pointer (RFC 6901) of a value."""
    return "".join(f"/{str(key).replace('~', '~0').replace('/', '~1')}" for key in keys)


def _problems(error: Any, path: Path, positions: Positions) -> Iterator[Problem]:
    keys = list(error.absolute_path)
    if "propertyNames" in error.absolute_schema_path:
        # The schema is that of the key: what it calls the instance is the key itself.
        yield Problem(path, positions.line([*keys, error.instance]), pointer(keys), _unknown(error.instance, error))
    elif error.validator == "additionalProperties" and error.validator_value is False:
        known = sorted(error.schema.get("properties", {}))
        for key in sorted(set(error.instance) - set(known), key=str):
            line = positions.line([*keys, key])
            yield Problem(path, line, pointer(keys), f"unknown key '{key}'.{_hint(key, known)} {_allowed(known)}")
    elif error.validator == "required":
        missing = [key for key in error.validator_value if key not in error.instance]
        # One error arrives per missing key, in the order of the list; its message quotes the key.
        key = next((key for key in missing if error.message.startswith(f"'{key}'")), missing[0])
        yield Problem(path, positions.line(keys), pointer(keys), f"the key '{key}' is missing{_described(error, key)}")
    elif error.validator in ("anyOf", "oneOf") and (branch := _meant(error)):
        for nested in branch:
            yield from _problems(nested, path, positions)
    else:
        yield Problem(path, positions.line(keys), pointer(keys), _message(error, keys, positions))


def _message(error: Any, keys: list[str | int], positions: Positions) -> str:
    if error.validator == "enum":
        return _unknown(error.instance, error)
    if error.validator in ("anyOf", "oneOf"):
        return f"{_shortened(repr(error.instance))} is not allowed here{_described(error)}"
    message = _shortened(error.message)
    if isinstance(error.instance, date):
        message = message.replace(repr(error.instance), positions.written(keys) or str(error.instance))
    advice = _advice(error, positions.written(keys)) if error.validator == "type" else ""
    if error.validator in ("minItems", "maxItems") and error.instance:
        advice = f"{len(error.instance)} values, not {error.validator_value}"
    return f"{message}{advice and f'. {advice}'}{_described(error)}"


def _unknown(value: Any, error: Any) -> str:
    allowed = [str(value) for value in error.validator_value] if error.validator == "enum" else []
    title = "nothing is written here" if value is None else f"'{value}' is not allowed here"
    return f"{title}.{_hint(value, allowed)} {_allowed(allowed)}".rstrip()


def _hint(wrong: Any, known: list[str]) -> str:
    if isinstance(wrong, bool):
        meant = "on" if wrong else "off"
        return f" YAML reads on and yes as true, off and no as false: put it in quotes, if you mean '{meant}'."
    return did_you_mean(str(wrong), known)


def _advice(error: Any, written: str | None) -> str:
    """Return what to write where YAML has read something of another type."""
    value = error.instance
    wanted = error.validator_value if isinstance(error.validator_value, list) else [error.validator_value]
    if value is None:
        return "Nothing is written there"
    if "string" in wanted and not isinstance(value, dict | list):
        return f'Put it in quotes: "{written}"' if written else "Put it in quotes"
    if isinstance(value, str) and {"integer", "number"} & set(wanted):
        with suppress(ValueError):
            float(value)
            return "Leave out the quotes"
    if "array" in wanted:
        return "A list is written in brackets: [a, b]"
    if "object" in wanted:
        return "Write indented keys below it, each with a colon and a value"
    return ""


def _meant(error: Any) -> list[Any]:
    """Return the errors of the alternative that was meant: the only one for values of that type, if there is one."""
    branches: dict[int, list[Any]] = {}
    for nested in error.context:
        branches.setdefault(nested.schema_path[0], []).append(nested)
    fitting = [
        nested for nested in branches.values() if not any(len(e.path) == 0 and e.validator == "type" for e in nested)
    ]
    return fitting[0] if len(fitting) == 1 else []


def _described(error: Any, key: str | None = None) -> str:
    schema = error.schema if key is None else error.schema.get("properties", {}).get(key, {})
    text = schema.get("description", "") if isinstance(schema, dict) else ""
    return f" ({text.rstrip('.')})" if text else ""


def _allowed(names: list[str]) -> str:
    if not names:
        return ""
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"Allowed: {', '.join(names[:MOST_NAMES])}{more}"


def _shortened(message: str) -> str:
    return message if len(message) <= _MOST_LETTERS else f"{message[:120]} … {message[-70:]}"
