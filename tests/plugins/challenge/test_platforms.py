"""The scoring program that the page on challenges has for Codabench, called as its worker calls one."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

from tests.command_line import CommandLine
from tests.plugins.batch.test_batch import truth

PAGE = Path(__file__).parents[3] / "docs" / "challenge.md"


def score(cli: CommandLine, app: Path) -> "subprocess.CompletedProcess[str]":
    """Run `/app/program/score.py` in its folder, with the folders that a worker gives it."""
    (program,) = re.findall(
        r"```python\n(import json\n(?:(?!```).)*scores\.json.*?)```", PAGE.read_text("utf-8"), re.DOTALL
    )
    (app / "program").mkdir(exist_ok=True)
    (app / "program" / "score.py").write_text(program)
    words = [sys.executable, "score.py", str(app / "input"), str(app / "output")]
    path = os.pathsep.join([str(Path(sys.executable).parent), cli.variables["PATH"]])
    variables = {**cli.variables, "PATH": path, "PYTHONUNBUFFERED": "1"}
    return subprocess.run(words, cwd=app / "program", env=variables, capture_output=True, text=True, check=False)


def test_codabench_scores_what_was_handed_in(result_folder: CommandLine, tmp_path: Path) -> None:
    cli, app = result_folder, tmp_path / "app"
    for name in ("input/res", "input/ref/ground_truths", "output"):
        (app / name).mkdir(parents=True)
    (app / "input" / "ref" / "ground_truths" / "1.json").write_text(truth(1))
    (cli.folder / "perfect.json").rename(app / "input" / "res" / "arena.json")
    done = score(cli, app)
    assert done.returncode == 0, done.stderr
    assert json.loads((app / "output" / "scores.json").read_text())["OMQ"] == 1.0

    (app / "output" / "scores.json").unlink()
    (app / "input" / "res" / "arena.json").write_text("no result")
    refused = score(cli, app)
    assert (refused.returncode, refused.stderr.strip()) == (1, "No result could be scored.")
    assert not list((app / "output").iterdir())
