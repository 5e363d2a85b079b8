"""Every hook, and the records that hooks yield, from their docstrings."""

import dataclasses
import inspect
from typing import Any

from benchbot.core import hookspecs, light_records, records
from docs.tools.reference.signatures import annotation, call
from docs.tools.reference.tables import GENERATED, code, paragraph, table

_INTRODUCTION = """\
# Hooks

What a plug-in may provide: see [your own plug-in](../plugins.md) for how, [declarations](declarations.md) for what the
files hold, and [the source](../../benchbot/core/records.py) of the records.
All of these names are in `benchbot.plugin`. A hook yields any number of things.

"""


def page() -> str:
    """Return the page of hooks."""
    hooks = [(name, hook) for name, hook in vars(hookspecs).items() if name.startswith("benchbot_")]
    rows = [[f"`{name}`", _yields(name), paragraph(inspect.getdoc(hook) or "")] for name, hook in hooks]
    text = GENERATED + _INTRODUCTION + table(["hook", "yields", ""], rows) + "\n## Records\n"
    modules = (records, light_records)
    found = [(module, item) for module in modules for item in vars(module).values() if inspect.isclass(item)]
    classes = [item for module, item in found if item.__module__ == module.__name__]
    protocols = [item for item in classes if getattr(item, "_is_protocol", False)]
    yielded = [item for item in classes if item not in (*protocols, light_records.Target)]
    text += "".join(map(_record, yielded))
    return text + "\n## What records hold\n" + "".join(map(_protocol, protocols))


def _yields(hook: str) -> str:
    record = hookspecs.KINDS.get(hook.removeprefix("benchbot_"))
    return f"[`{record.__name__}`](#{record.__name__.lower()})" if record else "paths"


def _record(record: Any) -> str:
    hints = record.__annotations__
    rows = [[code(name), code(annotation(hints[name])), _default(record, name)] for name in hints]
    said = paragraph(inspect.getdoc(record) or "")
    return f"\n### {record.__name__}\n\n{said}\n\n" + table(["field", "type", "default"], rows)


def _default(record: Any, name: str) -> str:
    """Return the default of a field of a named tuple or a dataclass."""
    defaults = dict(getattr(record, "_field_defaults", {}))
    if dataclasses.is_dataclass(record):
        (found,) = (item for item in dataclasses.fields(record) if item.name == name)
        if found.default_factory is not dataclasses.MISSING:
            return "empty"
        if found.default is not dataclasses.MISSING:
            defaults[name] = found.default
    return code(repr(defaults[name])) if name in defaults else "required"


def _protocol(protocol: Any) -> str:
    text = f"\n### {protocol.__name__}\n\n{paragraph(inspect.getdoc(protocol) or '')}\n\n"
    rows = []
    for name, member in vars(protocol).items():
        function = member.fget if isinstance(member, property) else member
        if not inspect.isfunction(function) or (name.startswith("_") and name != "__call__"):
            continue
        title = name if isinstance(member, property) else call("" if name == "__call__" else name, function)
        rows.append([code(title), paragraph(inspect.getdoc(function) or "")])
    return text + table(["member", ""], rows)
