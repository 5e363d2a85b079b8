"""What files say that they need, and whether that is all that Python then loads."""

import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchbot.plugins.batch.mentions import Import, of_python, of_text
from benchbot.plugins.batch.source_files import find

MODULES = ("run.py", "a.py", "p/__init__.py", "p/c.py", "p/d.py", "p/q/__init__.py", "p/q/e.py")
IMPORTS = (
    *("import a", "import p", "import p.c", "from p import d", "from p.q import e, nothing", "import p.q.e as e"),
    *("from . import c", "from .q import e", "from .. import d", "from ..c import X", "from p.q import *"),
    *("import importlib; importlib.import_module('p.c')", "__import__('p.q.e')", "import os, json"),
    "import importlib; importlib.import_module('.d', 'p')",
    "import importlib; [importlib.import_module(f'p.{name}') for name in ('c', 'd')]",
)
LOADED = """
import os, sys
if __name__ == "__main__":
    files = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
    print("\\n".join(os.path.relpath(file) for file in files if file and file.startswith(os.getcwd())))
"""


@pytest.mark.parametrize(
    ("code", "texts"),
    [
        ("open('a.yaml')", {"a.yaml"}),
        ("open(HERE / 'weights' / 'a.pt')", {"weights/a.pt"}),
        ("open(os.path.join(HERE, 'weights', f'{name}.pt'))", {"weights/*.pt"}),
        ("open((HERE / 'maps').joinpath(name))", {"maps/*"}),
        ("open('level_%02d.txt' % 3); open('{}.csv'.format(1))", {"level_*.txt", "*.csv"}),
        ("open('a' + ending)", {"a*"}),
        ("open('out.txt', 'w'); open('log.txt', mode='ab'); Path('x.txt').open('w')", set()),
        ("open('a.txt', 'rb'); Path('x.txt').open()", {"a.txt", "rb", "x.txt"}),
        ("np.save('grid.npy', np.load('start.npy'))", {"start.npy"}),
        ("'''A docstring.'''\nsettings['key.txt'] = {'key.yaml': 'value.yaml'}", {"value.yaml"}),
        ("' '.join(['a.txt'])", {"a.txt"}),
    ],
)
def test_the_texts_of_code_are_paths_as_they_are_put_together(code: str, texts: set[str]) -> None:
    assert set(of_python(code).texts) - {" "} == texts


def test_imports_are_found_wherever_they_are() -> None:
    said = of_python("def f():\n try:\n  from ..a.b import c as d\n except ImportError:\n  import e.f, g\n")
    assert set(said.imports) == {Import(0, "e.f"), Import(0, "g"), Import(2, "a.b", ("c",))}
    assert not said.is_dynamic
    assert of_python("from importlib import import_module\nimport_module(name)").is_dynamic
    assert not of_python("import_module('agents.' + name)").is_dynamic


def test_other_files_name_what_has_a_dot_or_a_slash_and_modules_that_are_run() -> None:
    said = of_text(b"#!/bin/sh\nexec python -m agent.run --cfg conf/a.yaml weights # data\0\1lib.so\xff")
    assert set(said.texts) == {"/bin/sh", "agent.run", "conf/a.yaml", "lib.so"}
    assert said.imports == (Import(0, "agent.run"), Import(0, "agent.run.__main__"))


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.lists(st.sampled_from(IMPORTS), max_size=3), min_size=len(MODULES), max_size=len(MODULES)))
def test_all_that_python_loads_of_a_solution_is_part_of_it(imports: list[list[str]]) -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place).resolve() / "solution"  # `from ..` finds nothing that others left beside it
        for name, lines in zip(MODULES, imports, strict=True):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            guarded = "".join(f"try:\n    {line}\nexcept ImportError:\n    pass\n" for line in lines if "*" not in line)
            stars = "".join(f"{line}\n" for line in lines if "*" in line and name != "p/q/__init__.py")
            (folder / name).write_text(f"X = 1\n{guarded}{stars}{LOADED if name == 'run.py' else ''}")
        done = subprocess.run(
            [sys.executable, "run.py"], cwd=folder, capture_output=True, text=True, check=True, timeout=60
        )
        assert set(done.stdout.split()) <= set(find(["python", "run.py"], folder).content.files)
