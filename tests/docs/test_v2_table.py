"""Every command of the table for those who come from v2 is one that there is, and every key one that is known."""

import json
import re
import shlex
from contextlib import suppress
from importlib.resources import files

import pytest
import typer

from tests.docs.blocks import ROOT
from tests.docs.parsing import parsed

PAGE = (ROOT / "docs" / "v2-table.md").read_text("utf-8")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("| ")]
V2 = {"benchbot_run": "run", "benchbot_submit": "submit", "benchbot_eval": "eval", "benchbot_batch": "batch"}
# What the four programs take themselves, before the command: see benchbot/plugins/v2/command.py.
NAMES = {
    "TASK": "scd:passive:ground_truth",
    "ROBOT": "carter",
    "FORMAT": "object_map",
    "METHOD": "omq",
    "BATCH": "develop_1",
    "NAME": "hello_passive",
}
OWN = {"-v", "--version", "-k", "--kill-controller"}


def here(command: str) -> str:
    """Return v2's command as `benchbot` is called with it."""
    program, *words = shlex.split(command)
    named = [NAMES.get(word, word).replace("ENV:", "miniroom:") for word in words]
    return shlex.join(["benchbot", *([V2[program]] if program in V2 else []), *named])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0][:60])
def test_every_command_is_one_that_there_is(row: list[str]) -> None:
    for command in re.findall(r"`(benchbot[ _][^`]+)`", " ".join(row)):
        if shlex.split(command)[0] in {*V2, "benchbot"} and shlex.split(command)[1] not in OWN:
            # Lists and the like are printed while a command line is parsed, which then ends.
            with suppress(typer.Exit):
                parsed(here(command))


def section(heading: str) -> str:
    return re.split(r"^## .*$", PAGE.partition(f"\n## {heading}\n")[2], flags=re.MULTILINE)[0]


@pytest.mark.parametrize(("heading", "kind"), [("Tasks", "task"), ("Environments", "environment"), ("Robots", "robot")])
def test_every_key_has_its_row(heading: str, kind: str) -> None:
    schema = json.loads((files("benchbot") / "schemas" / f"{kind}.json").read_text("utf-8"))
    rows = [line.strip("|").split("|") for line in section(heading).splitlines() if line.startswith("| ")][1:]
    named = {key for old, new in rows for key in re.findall(r"`(\w+)`", old if "–" not in old else new)}

    assert named == set(schema["properties"])


def test_every_option_of_v2_is_in_the_table() -> None:
    """Those of v2.5, long and short, as its programs parsed them."""
    words = set(re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*", PAGE))
    wanted = """
        --addons --addons-only --list-addons --list-simulators --no-simulator --no-update --remove-addons --simulators
        --uninstall --env --environment --force-updateless --kill-controller --list-envs --list-environments
        --list-formats --list-robots --list-tasks --robot --show-env --show-environment --show-format --show-robot
        --show-task --task --updates-check --version --args --example --evaluate-with --list-examples --show-example
        --native --results-location --method --output-location --required-envs --required-envs-batch --required-task
        --validate-only --list-batches --show-batch --list-methods --show-method --envs --envs-batch --prefix --zip
        --containerised --example-containerised --submission --branch --force-clean
    """
    assert set(wanted.split()) - words == set()
