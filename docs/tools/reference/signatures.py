"""How functions, methods and attributes are written in the reference."""

import ast
import inspect
import textwrap
from collections.abc import Callable
from itertools import pairwise
from typing import Any


def annotation(found: object) -> str:
    """Return a type as it is written in the code, without modules and quotes."""
    found = getattr(found, "__forward_arg__", found)
    text = found if isinstance(found, str) else inspect.formatannotation(found)
    for prefix in (
        "collections.abc.",
        "benchbot.core.records.",
        "benchbot.core.channels.",
        "benchbot.core.documents.",
        "benchbot.api.agent.",
        "typing.",
        "enum.",
    ):
        text = text.replace(prefix, "")
    return text.replace("ForwardRef('", "").replace("')", "").replace("'", "")


def call(name: str, function: Callable[..., Any]) -> str:
    """Return a function's name and parameters, without `self`, and what it returns unless that is nothing."""
    signature = inspect.signature(function)
    parameters = [_parameter(item) for item in signature.parameters.values() if item.name != "self"]
    returned = signature.return_annotation
    arrow = "" if returned in (inspect.Signature.empty, None, "None") else f" → {annotation(returned)}"
    return f"{name}({', '.join(parameters)}){arrow}"


def _parameter(parameter: inspect.Parameter) -> str:
    typed = "" if parameter.annotation is parameter.empty else f": {annotation(parameter.annotation)}"
    default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
    stars = (
        "**" if parameter.kind is parameter.VAR_KEYWORD else "*" if parameter.kind is parameter.VAR_POSITIONAL else ""
    )
    return f"{stars}{parameter.name}{typed}{default}"


def attribute_docs(cls: type) -> dict[str, str]:
    """Return the attributes of a class that have a docstring below them, and that."""
    parsed = ast.parse(textwrap.dedent(inspect.getsource(cls)))
    (body, *_) = (node.body for node in ast.walk(parsed) if isinstance(node, ast.ClassDef))
    found = {}
    for statement, following in pairwise(body):
        targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
        if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant):
            for target in targets:
                if isinstance(target, ast.Name):
                    found[target.id] = inspect.cleandoc(str(following.value.value))
    return found
