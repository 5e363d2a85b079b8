"""`benchbot tui` where there is no terminal: data on stdout, the rest on stderr."""

import json
import shlex
import subprocess
import sys
from pathlib import Path

from benchbot.plugins.tui import jobs
from tests.docs.blocks import ROOT
from tests.docs.commands import commands

PATIENCE_S = 120.0
SELECTION = ["--task=sample:passive", "--robot=sample_robot", "--env=arena:1"]


def tui(*words: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-P", "-m", "benchbot", "tui", *words]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=PATIENCE_S, check=False, stdin=subprocess.DEVNULL
    )


def test_what_is_alive_is_told_in_lines_and_as_json_and_wrong_words_are_explained(home: Path) -> None:
    nothing = tui()
    assert (nothing.returncode, nothing.stdout) == (0, "")
    assert "No run and no batch" in nothing.stderr
    unknown = jobs.start(["show", "robot", "nobody"])
    job = jobs.start(["run", *SELECTION, "--port=0"])
    state = jobs.wait_for_run(job, PATIENCE_S, 0.05)
    assert state is not None
    try:
        assert jobs.wait_for_run(unknown, PATIENCE_S, 0.05) is None, "it ends"
        # As docs/tui.md says it.
        page = (ROOT / "docs" / "tui.md").read_text("utf-8")
        typed = [command for command in commands(page) if "--display" in command]
        lines, document = (tui(*shlex.split(command)[2:]) for command in typed)
        assert "sample:passive, sample_robot, arena:1, seed 0" in lines.stdout
        assert "\x1b" not in lines.stdout + lines.stderr
        assert "job show robot nobody: 'nobody' is not a known robot." in lines.stdout
        assert [each["command"] for each in json.loads(document.stdout)["jobs"]] == ["benchbot show robot nobody"]
        found = json.loads(document.stdout)["runs"]
        assert [(run["environment"], run["pid"]) for run in found] == [("arena:1", job.pid)]
        wrong = tui("--run", "no-such-run")
        assert wrong.returncode == 2
        assert Path(state.folder).name in wrong.stderr
    finally:
        jobs.end(job)
    for words, told in (
        (["--run=a", "--batch=b"], "two things to watch"),
        (["--batch", str(home)], "is not the folder of a batch"),
    ):
        wrong = tui(*words)
        assert (wrong.returncode, wrong.stdout) == (2, "")
        assert told in wrong.stderr
