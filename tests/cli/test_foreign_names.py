"""Declarations and results of strangers, through the commands that show them: each name is text, and in its line."""

import csv
import io
import json
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from tests.command_line import CommandLine, Finished, environment

HOSTILE = "a\x1b]52;c;cm0=\x07\x9b2J\u202e\nResult: 1.0\r\x1b[1AError: x"
UNSEEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
CODE = """\
from importlib.resources import files
from benchbot.plugin import hookimpl

@hookimpl
def benchbot_environments():
    yield files(__name__) / "environments"

@hookimpl
def benchbot_examples():
    yield files(__name__) / "examples"
"""


def inert(done: Finished, *, is_page: bool = False) -> Finished:
    """Return how a command ended, after seeing that its words neither command a terminal nor begin a line.

    The lines of a page's source are not those of what it shows.
    """
    assert not UNSEEN.search(done.stdout + done.stderr), ascii(done.stdout + done.stderr)
    assert is_page or not re.search(r"^(Result: 1\.0|Error: x)", done.stdout + done.stderr, re.MULTILINE)
    assert "Internal error" not in done.stderr
    return done


@pytest.fixture
def stranger(make_plugin: Callable[..., Path], cli: CommandLine) -> CommandLine:
    """A command line that finds a plug-in of such declarations installed."""
    example = {"name": "shouts", "description": HOSTILE, "native_command": "python x.py"}
    files = {
        "environments/bad.yaml": yaml.safe_dump({**environment(1), "name": HOSTILE, "description": HOSTILE}),
        "examples/bad.yaml": yaml.safe_dump(example),
    }
    make_plugin("benchbot-stranger", CODE, files)
    return cli


@pytest.fixture
def handed_in(result_folder: CommandLine) -> CommandLine:
    """A folder with a result whose names are such, beside others, and a ZIP archive of it under such a name."""
    folder = result_folder.folder
    document = json.loads((folder / "perfect.json").read_text())
    document["environment_details"] = [{**document["environment_details"][0], "name": HOSTILE}]
    selection = {"task": HOSTILE, "robot": HOSTILE, "environment": HOSTILE, "seed": 1, "settings": {HOSTILE: HOSTILE}}
    document["provenance"] = {
        "benchbot": HOSTILE,
        "plugins": {HOSTILE: {"version": HOSTILE, "sha256": HOSTILE}},
        "steps": 1,
        "selection": selection,
        "simulated_time_s": 1.0,
        "observation_digest": "00",
        "failure": {"class": "agent", "why": HOSTILE},
    }
    (folder / "declared.yaml").write_text(
        yaml.safe_dump({**environment(1), "name": 1, "type": HOSTILE, HOSTILE: HOSTILE})
    )
    for name in ("a", "b"):
        (folder / name).mkdir()
        shutil.copy(folder / "perfect.json", folder / name)
        (folder / name / "hostile.json").write_text(json.dumps(document))
        with zipfile.ZipFile(folder / name / "more.zip", "w") as archive:
            archive.writestr(f"{HOSTILE}.json", json.dumps(document))
            archive.writestr(f"not {HOSTILE}.json", "{}")
    return result_folder


@pytest.mark.parametrize("kind", ["environments", "examples"])
def test_declarations_are_listed_and_shown(stranger: CommandLine, kind: str) -> None:
    listed = inert(stranger("list", kind))
    told = json.loads(inert(stranger("list", kind, "--json")).stdout)
    name = next(row["name"] for row in told if "Result: 1.0" in str(row))
    shown = inert(stranger("show", kind.removesuffix("s"), name))
    document = json.loads(inert(stranger("show", kind.removesuffix("s"), name, "--json")).stdout)

    assert listed.stdout.count("\n") == len(told)
    assert "Result: 1.0" in listed.stdout
    assert "description" in shown.stdout
    assert document["declaration"]["description"] == HOSTILE


@pytest.mark.parametrize(
    "words",
    [
        ["eval", "a"],
        ["eval", "a", "--json"],
        ["eval", "a", "--validate-only"],
        ["eval", "a", "--required-task", HOSTILE],
        ["list", HOSTILE],
        ["compare", f"{HOSTILE}=a", "b"],
        ["compare", "a", "b", "--json"],
        ["verify", "a"],
        *(["report", "a", "--format", form, "--name", HOSTILE] for form in ("md", "csv", "tex", "xml", "html")),
        ["check", "declared.yaml"],
        [HOSTILE],
    ],
    ids=lambda words: ascii(" ".join(words))[:30],
)
def test_results_are_scored_compared_and_reported(handed_in: CommandLine, words: list[str]) -> None:
    truth = ["--ground-truth", "truth.json"] if words[0] in ("eval", "compare", "report", "verify") else []

    done = inert(handed_in(*words, *truth), is_page="html" in words)

    assert re.search(r"Result: 1\.0|u009b|x9b", done.stdout + done.stderr)
    assert done.returncode in (0, 1, 2)
    if "--json" in words:
        json.loads(done.stdout)
    if "csv" in words:
        assert {len(row) for row in csv.reader(io.StringIO(done.stdout))} == {16}
