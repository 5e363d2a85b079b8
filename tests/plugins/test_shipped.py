"""What ships in the box is declared through the hooks, is valid, and is cheap to list."""

import subprocess
import sys

import pytest

from benchbot.core.declarations.catalog import Catalog
from benchbot.core.plugin_manager import load


def test_the_box_holds_formats_and_examples() -> None:
    catalog = Catalog(load())

    for kind, names in {
        "formats": ("object_map", "object_map_ground_truth", "object_map_with_states"),
        "examples": ("hello_active", "hello_passive"),
    }.items():
        for name in names:
            assert catalog.get(kind, name).distribution == "benchbot"


@pytest.mark.parametrize("name", ["hello_active", "hello_passive"])
def test_an_example_runs_a_file_that_lies_beside_its_declaration(name: str) -> None:
    example = Catalog(load()).get("examples", name)
    program, script = example.data["native_command"].split()

    assert program == "python"
    assert (example.path.parent / script).is_file()


def test_loading_the_plugins_of_the_box_imports_nothing_heavy() -> None:
    code = """
import sys
from importlib import import_module
from benchbot.core import entry_points
for point in entry_points.find("benchbot", "benchbot-"):
    import_module(point.value)
import benchbot.plugins.formats.object_map_with_states
import benchbot_eval_omq.plugin, benchbot_task_semslam.plugin
print(*(name for name in ("numpy", "scipy", "jsonschema", "yaml", "httpx", "starlette") if name in sys.modules))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert done.stdout.split() == []
