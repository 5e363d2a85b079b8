"""What a solution imports, from docstrings."""

import inspect

from benchbot.api import ActionResult, Agent, BenchBot, BenchbotError
from benchbot.api.tools import ObservationVisualiser
from docs.tools.reference.signatures import attribute_docs, call
from docs.tools.reference.tables import GENERATED, code, paragraph, table

_INTRODUCTION = """\
# The Python API of solutions

`from benchbot.api import Agent, ActionResult, BenchBot`; under the name `benchbot_api` as well, as in v2. How a
solution comes about is in [your first agent](../tutorials/first-agent.md), what the observations hold in
[observations and actions](channels.md); for reinforcement learning there is [Gymnasium](../gymnasium.md).

"""
_CLASSES = {
    "benchbot.api": (Agent, BenchBot, ActionResult, BenchbotError),
    "benchbot.api.tools": (ObservationVisualiser,),
}


def page() -> str:
    """Return the page of what solutions import."""
    sections = [_section(module, cls) for module, classes in _CLASSES.items() for cls in classes]
    return GENERATED + _INTRODUCTION + "\n".join(sections)


def _section(module: str, cls: type) -> str:
    text = f"## {cls.__name__}\n\n`{module}.{cls.__name__}`\n\n{paragraph(inspect.getdoc(cls) or '')}\n"
    rows = [[code(name), paragraph(said)] for name, said in attribute_docs(cls).items()]
    for name, member in vars(cls).items():
        function = member.fget if isinstance(member, property) else member
        shown = not name.startswith("_") or name == "__init__"
        if shown and inspect.isfunction(function) and function.__doc__:
            title = (
                name if isinstance(member, property) else call(cls.__name__ if name == "__init__" else name, function)
            )
            rows.append([code(title), paragraph(inspect.getdoc(function) or "")])
    return text + ("\n" + table(["member", "meaning"], rows) if rows else "")
