"""Homes, folders and alphabets that are not the developer's: the main commands, as root and as an ordinary user."""

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

from benchbot.cli.kit import console
from tests.cli.solutions import PASSIVE
from tests.cli.submitted import SELECTION
from tests.command_line import COMMAND, CommandLine, Finished, environment
from tests.submission.ordinary import ordinarily

ALPHABETS = {
    "latin-1": {"PYTHONIOENCODING": "iso-8859-1"},
    "ascii": {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
}
TITLE = "\u4e2d\u6587 \u2026 \U0001f916"
DECLARES = """\
from importlib.resources import files
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_environments():
    yield files(__name__) / "environments"
"""


@pytest.fixture(params=["root", "ordinary"])
def user(request: pytest.FixtureRequest, cli: CommandLine) -> Iterator[Callable[..., Finished]]:
    """Runs a command from `/` in a home with a space in its name, and none of BenchBot's folders named."""
    with tempfile.TemporaryDirectory(prefix="a user ") as name:
        top = Path(name)
        top.chmod(0o755)
        (top / "a home").mkdir()
        (top / "solution.py").write_text(PASSIVE)
        kept = {key: value for key, value in cli.variables.items() if not key.endswith("_DIR") and key != "TMPDIR"}
        variables = {
            **{key: value for key, value in kept.items() if not key.startswith("XDG_")},
            "HOME": str(top / "a home"),
            "PYTHONDONTWRITEBYTECODE": "1",
        }

        def run(*words: str) -> Finished:
            words = tuple(word.replace("TOP", name) for word in words)
            command = [*COMMAND, *words] if request.param == "root" else ordinarily([*COMMAND, *words], top)
            return subprocess.run(
                command, cwd="/", env=variables, capture_output=True, text=True, timeout=120, check=False
            )

        yield run


def test_a_home_with_spaces_serves_every_command_from_the_root_folder(user: Callable[..., Finished]) -> None:
    solution = f"{sys.executable} 'TOP/solution.py'"

    listed = user("list", "tasks")
    submitted = user("submit", "--native", solution, *SELECTION, "-r", "TOP/result.json")
    batch = user(
        *("batch", "--task", "sample:passive", "--robots", "sample_robot", "--envs", "arena:1", "--seeds", "0..0"),
        *("--native", solution, "-o", "TOP/batch"),
    )

    assert "sample:passive" in listed.stdout
    assert [done.returncode for done in (listed, submitted, batch)] == [0, 0, 0], submitted.stderr + batch.stderr
    assert "a user " in submitted.stdout + submitted.stderr


@pytest.mark.parametrize("alphabet", ALPHABETS)
def test_what_an_alphabet_lacks_is_shown_as_its_escape(
    alphabet: str, make_plugin: Callable[..., Path], cli: CommandLine
) -> None:
    declared = {**environment(1), "name": "far", "description": TITLE}
    make_plugin("benchbot-far", DECLARES, {"environments/far.yaml": yaml.safe_dump(declared, allow_unicode=True)})

    shown = cli("show", "env", "far:1", **ALPHABETS[alphabet])
    helped = cli("run", "--help", **ALPHABETS[alphabet])

    assert (shown.returncode, helped.returncode) == (0, 0), shown.stderr + helped.stderr
    assert TITLE.encode("ascii", "backslashreplace").decode() in shown.stdout


def test_json_says_the_same_in_every_alphabet(capsysbinary: pytest.CaptureFixture[bytes]) -> None:
    sys.stdout.reconfigure(encoding="iso-8859-1")  # type: ignore[union-attr]

    console.data_json({"description": TITLE})

    assert json.loads(capsysbinary.readouterr().out.decode("ascii")) == {"description": TITLE}


@pytest.mark.parametrize(
    ("shell", "asked"),
    [
        ("bash", {"COMP_WORDS": "benchbot ev", "COMP_CWORD": "1"}),
        ("zsh", {"_TYPER_COMPLETE_ARGS": "benchbot ev"}),
        ("fish", {"_TYPER_COMPLETE_ARGS": "benchbot ev", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}),
    ],
)
def test_a_shell_completes_a_command(shell: str, asked: dict[str, str], cli: CommandLine) -> None:
    completed = cli(**asked, _BENCHBOT_COMPLETE=f"complete_{shell}")

    assert completed.returncode == 0, completed.stderr
    assert "eval" in completed.stdout
    assert "submit" not in completed.stdout
