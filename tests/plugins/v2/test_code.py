import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.v2.code import Code

Functions = Callable[..., dict[str, Callable[..., Any]]]


@pytest.fixture
def functions(tmp_path: Path) -> Functions:
    """Returns the functions `name=target` of a declaration beside these files."""

    def load(files: dict[str, str], **targets: str) -> dict[str, Callable[..., Any]]:
        for name, text in files.items():
            path = tmp_path / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        return Code.read(tmp_path, tmp_path.rglob("*.py")).functions(tmp_path / "x.yaml", targets)

    return load


def test_modules_find_those_beside_them_also_late_and_leave_nothing_behind(functions: Functions) -> None:
    path, finders, modules = [*sys.path], [*sys.meta_path], set(sys.modules)
    late = "import near\n\ndef f():\n    import package.part\n    return near.A + package.part.B\n"
    files = {"late.py": late, "near.py": "A = 1", "package/__init__.py": "", "package/part.py": "B = 2"}

    assert functions(files, f="late.f")["f"]() == 3
    assert (sys.path, sys.meta_path) == (path, finders)
    assert not {"late", "near", "package"} & (set(sys.modules) - modules)


def test_modules_of_the_same_name_do_not_meet(functions: Functions, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "near", sys)

    assert functions({"a.py": "import near\nf = near.f", "near.py": "def f(): return 'mine'"}, f="a.f")["f"]() == "mine"
    assert sys.modules["near"] is sys


def test_what_runs_is_what_was_read(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("def f(): return 'read'")
    code = Code.read(tmp_path, [tmp_path / "a.py"])
    (tmp_path / "a.py").write_text("def f(): return 'swapped'")

    assert code.functions(tmp_path / "x.yaml", {"f": "a.f"})["f"]() == "read"
    assert [path.name for path in tmp_path.iterdir()] == ["a.py"]


def test_a_function_keeps_its_modules_state(functions: Functions) -> None:
    found = functions({"a.py": "n = []\ndef f():\n    n.append(1)\n    return len(n)"}, f="a.f", g="a:f")

    assert [found["f"](), found["g"](), found["f"]()] == [1, 2, 3]


@pytest.mark.parametrize(
    ("text", "target", "message"),
    [
        ("def f(): pass", "aa.f", "holds no aa.py. Did you mean 'a'?"),
        ("def fun(): pass", "a.fnu", "has no function 'fnu'. Did you mean 'fun'?"),
        ("f = 1", "a.f", "has no function 'f'"),
        ("def f(): pass", "json.loads", "holds no json.py"),
        ("def f(): pass", "f", "holds no .py"),
        ("def f(:", "a.f", "SyntaxError: invalid syntax (a.py:1)"),
        ("\n\n1 / 0", "a.f", "ZeroDivisionError: division by zero (a.py:3)"),
        ("import no_such_module", "a.f", "No module named 'no_such_module' (a.py:1)"),
        ("raise SystemExit(3)", "a.f", "SystemExit: 3"),
    ],
)
def test_what_cannot_be_imported_is_named(text: str, target: str, message: str, functions: Functions) -> None:
    with pytest.raises(BenchbotError) as caught:
        functions({"a.py": text}, f=target)

    assert message in caught.value.why


def test_missing_requirements_are_those_that_v2_lists(functions: Functions, tmp_path: Path) -> None:
    (tmp_path / ".dependencies-python").write_text("no-such-module\n")

    with pytest.raises(BenchbotError) as caught:
        functions({"a.py": "import no_such_module"}, f="a.f")

    assert caught.value.fix.endswith(f"pip install -r {tmp_path}/.dependencies-python")


@pytest.mark.parametrize(
    ("body", "title", "why"),
    [
        ("assert n > 3, 'too few'", "f() refuses what it was given.", "too few ("),
        ("assert n > 3", "f() refuses what it was given.", "This does not hold: assert n > 3 ("),
        ("return {}['x']", "f() failed.", "KeyError: 'x' ("),
        ("return n + 'x'", "f() failed.", "TypeError: unsupported operand"),
    ],
)
def test_what_a_function_raises_is_told_in_words(body: str, title: str, why: str, functions: Functions) -> None:
    found = functions({"a.py": f"def f(n):\n    {body}\n"}, f="a.f")

    with pytest.raises(BenchbotError) as caught:
        found["f"](1)

    assert caught.value.title == title
    assert caught.value.why.startswith(why)
    assert caught.value.why.endswith("(a.py:2)")


def test_arguments_that_do_not_fit_are_a_mistake_of_the_caller(functions: Functions) -> None:
    with pytest.raises(TypeError, match="missing 1 required positional argument"):
        functions({"a.py": "def f(n): pass"}, f="a.f")["f"]()
