"""What a shell offers for the values of options and arguments."""

import re
import subprocess

import pytest

from tests.command_line import COMMAND, CommandLine, Here


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("submit --task sample:pa", ["sample:passive"]),
        ("run --robot sample_r", ["sample_real_robot", "sample_robot"]),
        ("submit --env ar", ["arena:1", "arena:2"]),
        ("batch --envs arena:1,ar", ["arena:1,arena:1", "arena:1,arena:2"]),
        ("submit --example hello_p", ["hello_passive"]),
        ("eval --method o", ["omq"]),
        ("submit --record f", ["frames"]),
        ("batch --executor lo", ["local"]),
        ("show robot sample_c", ["sample_careful_robot"]),
        ("uninstall benchbot-s", ["benchbot-sample"]),
        ("submit --task no-such", []),
    ],
)
def test_what_is_installed_is_offered(
    typed: str, offered: list[str], here: Here, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_BENCHBOT_COMPLETE", "complete_zsh")
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", f"benchbot {typed}")

    said = here().stdout

    assert [name.replace("\\\\:", ":") for name in re.findall(r'"([^"]*)"', said)] == offered


@pytest.mark.parametrize(
    ("words", "place", "offered"),
    [
        ("benchbot submit --env ar", 3, "arena:1 arena:2"),
        ("benchbot submit --env arena : ''", 5, "1 2"),
        ("benchbot submit --env arena : 1", 5, "1"),
        ("benchbot submit --env arena:1 --task sample : pas", 7, "passive"),
        ("benchbot batch --envs arena : 1,arena : ''", 7, "1 2"),
        ("benchbot ev", 1, "eval"),
    ],
)
def test_bash_which_parts_words_at_colons_completes_names_with_colons(
    words: str, place: int, offered: str, cli: CommandLine
) -> None:
    program = cli.folder / "benchbot"
    program.write_text(f'#!/bin/sh\nexec {" ".join(COMMAND)} "$@"\n')
    program.chmod(0o755)
    script = f"""
eval "$(_BENCHBOT_COMPLETE=source_bash ./benchbot)"
COMP_WORDS=({words}) COMP_CWORD={place}
_benchbot_completion ./benchbot
echo "${{COMPREPLY[@]}}"
"""

    done = subprocess.run(
        ["bash", "--norc", "-c", script], capture_output=True, text=True, cwd=cli.folder, env=cli.variables, check=False
    )

    assert done.stdout.strip() == offered, done.stderr
