"""Every command with its arguments and options, as typer knows them."""

import inspect
import re
from collections.abc import Iterator
from typing import Any

from benchbot.cli.app import EVERYDAY, Stub
from benchbot.core import plugin_manager
from docs.tools.reference.tables import GENERATED, code, plain, table

_INTRODUCTION = """\
# Every command and option

What `--help` prints, in one page. How they are used together is in [the command line](../cli.md), what they return
in [exit codes](exit-codes.md).

"""


def page() -> str:
    """Return the page of commands: BenchBot's own, then those of its plug-ins."""
    sections = [_section(f"benchbot {name}", command, distribution) for name, command, distribution in _commands()]
    return GENERATED + _INTRODUCTION + "\n".join(sections)


def _commands() -> Iterator[tuple[str, Any, str]]:
    for record in EVERYDAY:
        yield record.name, Stub(record).load(), "benchbot"
    provided = plugin_manager.load().pool("commands")
    ours = [item for item in provided.values() if item.distribution.startswith("benchbot")]
    for item in sorted(ours, key=lambda item: (item.distribution, item.value.name)):
        yield item.value.name, Stub(item.value).load(), item.distribution


def _section(words: str, command: Any, distribution: str, level: int = 2) -> str:
    shown = [parameter for parameter in command.params if not getattr(parameter, "hidden", False)]
    arguments = [parameter for parameter in shown if parameter.param_type_name == "argument"]
    options = [parameter for parameter in shown if parameter.param_type_name == "option"]
    children = getattr(command, "commands", {})
    text = f"{'#' * level} {words}\n\n"
    if distribution != "benchbot":
        text += f"Of the distribution `{distribution}`. "
    text += _help(command.help or "") + "\n"
    usage = " ".join(
        [words, *(["COMMAND"] if children else []), *map(_usage, arguments), *(["[OPTIONS]"] if options else [])]
    )
    text += f"\n```text\n{usage}\n```\n"
    if arguments:
        rows = [[code(_name(argument)), plain(argument.help or "")] for argument in arguments]
        text += "\n" + table(["argument", "meaning"], rows)
    if options:
        text += "\n" + table(["option", "meaning"], [[_spelling(option), _meaning(option)] for option in options])
    for name, child in children.items():
        if child.hidden:
            continue
        text += "\n" + _section(f"{words} {name}", child, "benchbot", level + 1)
    return text


def _help(text: str) -> str:
    """Return a help text: its paragraphs, and as code those that are laid out by hand (after `\\b`)."""
    paragraphs = []
    for part in re.split(r"\n\s*\n", inspect.cleandoc(text).replace("\f", "").replace("\b\n", "\n\b")):
        laid_out = "\b" in part or "  " in part.strip()
        body = part.replace("\b", "").strip("\n")
        paragraphs.append(f"```text\n{body}\n```" if laid_out else plain(" ".join(body.split())))
    return "\n\n".join(filter(None, paragraphs))


def _name(argument: Any) -> str:
    return str(argument.metavar or argument.name.upper())


def _usage(argument: Any) -> str:
    name = _name(argument).strip("[]") if not argument.required else _name(argument)
    name += "…" if argument.nargs == -1 else ""
    return name if argument.required else f"[{name}]"


def _spelling(option: Any) -> str:
    names = ", ".join([*option.opts, *option.secondary_opts])
    if getattr(option, "is_flag", False):
        return code(names)
    return code(f"{names} {option.metavar or option.name.upper()}")


def _meaning(option: Any) -> str:
    said = plain(option.help or "")
    given = option.default
    if getattr(option, "is_flag", False) or given is None or callable(given) or given in ((), [], ""):
        return said
    return said + f" Default: `{given}`." if "[default" not in said else said
