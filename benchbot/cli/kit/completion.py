"""Completion of values by a shell: options and arguments that name what is installed."""

import os
from functools import partial
from types import SimpleNamespace
from typing import Any

VARIABLE = "_BENCHBOT_COMPLETE"
"""Set by the shell, to `complete_bash` and the like, where it asks what may follow."""

_POOLS = {
    **dict.fromkeys(("--task", "--required-task", "show task"), "tasks"),
    **dict.fromkeys(("--robot", "--robots", "show robot"), "robots"),
    **dict.fromkeys(("--env", "--envs", "--required-envs", "show env", "show environment"), "environments"),
    **dict.fromkeys(("--envs-batch", "--required-envs-batch", "show batch"), "batches"),
    **dict.fromkeys(("--example", "show example"), "examples"),
    **dict.fromkeys(("--method", "--evaluate-with", "show method"), "evaluators"),
    **dict.fromkeys(("uninstall", "upgrade", "plugins show"), "plugins"),
    "--executor": "executors",
    "--record": "recorders",
    "show episodes": "episodes",
    "show format": "formats",
    "show simulator": "simulators",
}
_RECORDS = ("evaluators", "executors", "recorders", "simulators")


def join_words() -> None:
    """Join what bash gives in pieces: it takes the colon in `miniroom:1` for a word of its own."""
    if os.environ.get(VARIABLE) != "complete_bash":
        return
    separator = "\n" if "\n" in os.environ["COMP_WORDS"] else " "
    joined = [""]
    for word in os.environ["COMP_WORDS"].split(separator)[: int(os.environ["COMP_CWORD"]) + 1]:
        if word == ":" or joined[-1].endswith(":"):
            joined[-1] += word
        else:
            joined.append(word)
    os.environ |= {"COMP_WORDS": separator.join(joined[1:]), "COMP_CWORD": str(len(joined) - 2)}


def attach(command: Any, words: str) -> None:
    """Have the values of a command, called by `words`, and of those below it completed."""
    for parameter in command.params:
        keys = parameter.opts if parameter.param_type_name == "option" else [words]
        pool = next((_POOLS[key] for key in keys if key in _POOLS), None)
        if pool is not None:
            # Typer takes a function only where an option is declared, which is in many places.
            parameter._custom_shell_complete = partial(_values, pool)
    for name, below in getattr(command, "commands", {}).items():
        attach(below, f"{words} {name}")


def _values(pool: str, _context: Any, _parameter: Any, begun: str) -> list[Any]:
    """Return the names in a pool that go on from what was typed, after its last comma."""
    first, comma, begun_name = begun.rpartition(",")
    # Bash replaces what follows the last colon only.
    kept = len(begun.rpartition(":")[0]) + 1 if ":" in begun and os.environ[VARIABLE] == "complete_bash" else 0
    names = [name for name in _names(pool) if name.startswith(begun_name)]
    # What a shell is told has these attributes, and another home in each version of typer.
    return [SimpleNamespace(value=f"{first}{comma}{name}"[kept:], help=None, type="plain") for name in names]


def _names(pool: str) -> list[str]:
    from benchbot.core.declarations.catalog import Catalog
    from benchbot.core.plugin_manager import installed, load

    if pool == "plugins":
        return sorted({plugin.distribution for plugin in installed()} - {"benchbot"})
    return sorted(load().pool(pool)) if pool in _RECORDS else Catalog(load()).names(pool)
