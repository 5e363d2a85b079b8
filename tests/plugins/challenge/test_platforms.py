"""The programs that the page on challenges has for Codabench and EvalAI, called as their workers call them."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

from tests.cli.solutions import PASSIVE
from tests.cli.submitted import SELECTION
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


def test_evalai_scores_what_was_handed_in(cli: CommandLine, tmp_path: Path) -> None:
    """As its remote evaluation calls `evaluate`: with the file and the phase, for scores by dataset split."""
    (program,) = re.findall(
        r"```python\n(import json\n(?:(?!```).)*def evaluate.*?)```", PAGE.read_text("utf-8"), re.DOTALL
    )
    held_out, secret, solution = tmp_path / "held_out", tmp_path / "runs.secret", cli.folder / "solution"
    for folder in (held_out / "ground_truths", solution):
        folder.mkdir(parents=True)
    (held_out / "ground_truths" / "1.json").write_text(truth(1))
    secret.write_text("a" * 64)
    (solution / "solution.py").write_text(PASSIVE)
    for before, after in (
        (
            '"/srv/challenge/heldout", ["heldout:1"], "/srv/challenge/runs.secret"',
            f'{str(held_out)!r}, ["arena:1"], {str(secret)!r}',
        ),
        ("semantic_slam:passive:ground_truth", "sample:passive"),
        ('"carter"', '"sample_robot"'),
    ):
        assert before in program
        program = program.replace(before, after)
    (tmp_path / "evaluation.py").write_text(
        f"{program}\nimport sys\nprint(json.dumps(evaluate(sys.argv[1], 'dev', submission_metadata={{}})))\n"
    )
    ran = cli("submit", *SELECTION, "--native", f"{sys.executable} {solution / 'solution.py'}", "-r", "result.json")
    assert ran.returncode == 0, ran.stderr
    bundled = cli("bundle", "result.json", "--solution", "solution")
    assert bundled.returncode == 0, bundled.stderr

    def evaluated(name: str) -> "subprocess.CompletedProcess[str]":
        path = os.pathsep.join([str(Path(sys.executable).parent), cli.variables["PATH"]])
        words = [sys.executable, str(tmp_path / "evaluation.py"), name]
        variables = {**cli.variables, "PATH": path}
        return subprocess.run(words, cwd=cli.folder, env=variables, capture_output=True, text=True, check=False)

    done = evaluated("bundle.zip")
    assert done.returncode == 0, done.stderr
    ((split, scores),) = json.loads(done.stdout)["result"][0].items()
    assert (split, scores["OMQ"]) == ("test_split", 0.0)
    refused = evaluated("result.json")
    assert "Exception: The file is not a sound bundle" in refused.stderr
    assert secret.read_text() not in f"{done.stdout}{done.stderr}{refused.stderr}"
