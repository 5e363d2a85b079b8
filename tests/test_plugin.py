"""The public side for plug-ins: it is what type checkers see of it, and importing it costs next to nothing."""

import ast
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import benchbot.plugin as public
from benchbot.core.hookspecs import KINDS

HEAVY = ("numpy", "pluggy", "yaml", "jsonschema", "msgspec", "typer", "starlette")


def shown_to_type_checkers() -> set[str]:
    """Return the names that the module's `if TYPE_CHECKING:` gives."""
    module = ast.parse(Path(public.__file__).read_text("utf-8"))
    (block,) = (node for node in module.body if isinstance(node, ast.If))
    found = set()
    for node in block.body:
        if isinstance(node, ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            assert isinstance(target, ast.Name)
            found.add(target.id)
    return {name for name in found if not name.startswith("_")}


def test_what_type_checkers_see_is_what_there_is() -> None:
    assert shown_to_type_checkers() == set(public.__all__) - {"hookimpl"}


@pytest.mark.parametrize("name", public.__all__)
def test_every_name_can_be_imported(name: str) -> None:
    assert getattr(public, name) is not None


def test_every_record_that_a_hook_yields_is_public() -> None:
    assert {record.__name__ for record in KINDS.values()} <= set(public.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Simulatr'"):
        _ = public.Simulatr


def test_importing_it_imports_nothing_else() -> None:
    code = "import sys, benchbot.plugin; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = done.stdout.split()
    assert [name for name in loaded if name in HEAVY or name.startswith("benchbot.core")] == []


def test_what_plugins_of_the_first_version_imported_still_works_and_warns() -> None:
    with pytest.warns(DeprecationWarning, match=r"Import hookimpl from benchbot\.plugin"):
        assert import_module("benchbot").hookimpl is public.hookimpl
    with pytest.warns(DeprecationWarning, match=r"Import Recorder from benchbot\.plugin"):
        assert import_module("benchbot.core.hookspecs").Recorder is public.Recorder
    with pytest.warns(DeprecationWarning, match=r"Import hookimpl from benchbot\.plugin"):
        assert import_module("benchbot.core.hookspecs").hookimpl is public.hookimpl
