"""`bundle`, `reproduce` and `verify`, from a result to somebody else's machine."""

import json
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.cli.solutions import HANGING, PASSIVE
from tests.cli.submitted import SELECTION
from tests.command_line import CommandLine, Finished, Here, ended, wait_for
from tests.plugins.bundles.elsewhere import fresh_environment, packages_of

WAVERING = """\
import os, sys
from benchbot.api import BenchBot
import json
benchbot = BenchBot()
benchbot.step("move_next")
if os.path.exists(sys.argv[1]):
    benchbot.step("move_next")
with open(benchbot.result_filename, "w") as file:
    json.dump(benchbot.empty_results(), file)
"""
"""A solution that does one thing more where a file exists."""


def test_a_bundle_gives_the_same_in_a_fresh_environment(cli: CommandLine, tmp_path: Path) -> None:
    folder = cli.folder / "solution"
    folder.mkdir()
    (folder / "run.py").write_text(PASSIVE)
    python = fresh_environment(tmp_path / "here")
    at_home = Place(python, cli.folder, cli)
    for seed, secret in (("1", []), ("2", ["--secret", "random"])):
        solution = f"{python} solution/run.py"
        words = ("--native", solution, *SELECTION, "--seed", seed, *secret, "-r", f"results/{seed}.json")
        done = at_home("submit", *words)
        assert done.returncode == 0, done.stderr

    wrong_folder = at_home("bundle", "results", "--solution", "solution")
    others = [word for name in ("results", "made") for word in ("--leave-out", name)]
    made = at_home("bundle", "results", "--solution", ".", *others, "-o", "made/one.zip")
    again = at_home("bundle", "results", "--solution", ".", *others, "-o", "2.zip")

    assert (wrong_folder.returncode, made.returncode, made.stdout) == (2, 0, "made/one.zip\n"), made.stderr
    assert "Name the folder that the command ran in with --solution" in wrong_folder.stderr
    bundle = cli.folder / "made" / "one.zip"
    assert bundle.read_bytes() == (cli.folder / "2.zip").read_bytes(), again.stderr

    home = tmp_path / "other_home"
    home.mkdir()
    package = packages_of(tmp_path / "here") / "benchbot"
    elsewhere = Place(fresh_environment(tmp_path / "elsewhere", package), home, cli)
    done = elsewhere("reproduce", str(bundle), "--json", "-r", "new", "--native", "--trust")

    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert [row["likeness"] for row in told["results"]] == ["identical", "identical"]
    assert told["software"] == []
    new = json.loads((home / "new" / "0001-arena-1-seed-1.json").read_text())["provenance"]
    old = json.loads((cli.folder / "results" / "1.json").read_text())["provenance"]
    assert new["observation_digest"] == old["observation_digest"]
    assert new["solution"]["command"] == ["python", "solution/run.py"]
    assert cli.nothing_is_left()


@dataclass(frozen=True)
class Place:
    """Runs `benchbot` of an environment in a folder, with a cache of its own."""

    python: Path
    folder: Path
    cli: CommandLine

    def __call__(self, *words: str) -> Finished:
        variables = {name: value for name, value in self.cli.variables.items() if name != "PYTHONPATH"}
        return subprocess.run(
            [self.python, "-m", "benchbot", *words],
            capture_output=True,
            text=True,
            check=False,
            cwd=self.folder,
            timeout=300,
            env={**variables, "BENCHBOT_CACHE_DIR": str(self.cli.home / f"cache of {self.folder.name}")},
        )


def test_a_solution_that_does_something_else_is_told_where_it_parts(cli: CommandLine, here: Here) -> None:
    mark = cli.folder / "mark"
    mark.touch()
    script = cli.script("wavering.py", WAVERING)
    ran = here("submit", "--native", f"{script} {mark.parent}/nothing", *SELECTION, "-r", "result.json")
    assert ran.returncode == 0, ran.stderr
    words = ["--solution", "wavering.py", "--command", f"python wavering.py {mark}"]
    assert here("bundle", "result.json", *words, "-o", "bundle.zip").returncode == 0

    done = here("reproduce", "bundle.zip", "--native", "--trust")

    assert done.returncode == 1
    assert done.stdout == "different  arena:1, seed 0\n"
    assert "There are 3 observations instead of 2; as long as there are both, they agree." in done.stderr
    verified = here("verify", "bundle.zip", "--json")
    assert (verified.returncode, json.loads(verified.stdout)["results"][0]["outcome"]) == (0, "verified")
    assert cli.nothing_is_left()


def test_scores_are_part_of_it(result_folder: CommandLine, here: Here) -> None:
    cli = result_folder
    script = cli.script("solution.py", PASSIVE)
    assert here("submit", "--native", script, *SELECTION, "-r", "result.json").returncode == 0
    truth = ["--ground-truth", "truth.json"]
    bundled = here("bundle", "result.json", "--solution", "solution.py", "-e", "omq", *truth)
    assert bundled.returncode == 0, bundled.stderr

    done = here("reproduce", "bundle.zip", "--json", *truth)
    assert (done.returncode, json.loads(done.stdout)["scored_with"]) == (0, "omq"), done.stderr
    unscored = here("reproduce", "bundle.zip", "--native", "--trust")
    assert (unscored.returncode, unscored.stdout) == (0, "identical  arena:1, seed 0\n")
    assert "Not scored: " in unscored.stderr
    checked, unchecked = (here("reproduce", "bundle.zip", "--check-only", *words) for words in (truth, []))
    assert (checked.returncode, "its scores are those of its results" in checked.stderr) == (0, True), checked.stderr
    assert (unchecked.returncode, "Its scores could not be computed again" in unchecked.stderr) == (2, True)

    assert here("eval", "bundle.zip", *truth, "-o", "scores.json").returncode == 0
    right = here("verify", "result.json", "--scores", "scores.json", *truth)
    assert right.returncode == 0, right.stderr
    assert right.stdout == (
        "verified but for the answer, which is the solution's own  arena:1, seed 0  result.json  "
        "actions, observations, budgets (3 steps, 0 restarts), score (OMQ 0.0000)\n"
    )
    scores = json.loads((cli.folder / "scores.json").read_text())
    scores["rows"][0]["scores"]["OMQ"] = 1.0
    (cli.folder / "scores.json").write_text(json.dumps(scores))
    wrong = here("verify", "result.json", "--scores", "scores.json", *truth)
    assert wrong.returncode == 1
    assert "arena:1, seed 0: OMQ is 0, not 1" in wrong.stderr
    false = here("bundle", "result.json", "--solution", "solution.py", "--scores", "scores.json", "-o", "false.zip")
    assert false.returncode == 0, false.stderr
    for words in (["--native", "--trust"], ["--check-only"]):
        found_out = here("reproduce", "false.zip", *words, *truth)
        assert found_out.returncode == 1
        assert "The scores in the bundle are not those of its results: arena:1, seed 0: OMQ is 0, not 1" in (
            found_out.stderr
        )


def test_an_answer_that_is_the_truth_is_never_plainly_verified(result_folder: CommandLine, here: Here) -> None:
    cli = result_folder
    script = cli.script("solution.py", PASSIVE)
    assert here("submit", "--native", script, *SELECTION, "-r", "result.json").returncode == 0
    result, perfect = (json.loads((cli.folder / name).read_text()) for name in ("result.json", "perfect.json"))
    (cli.folder / "result.json").write_text(json.dumps({**result, "results": perfect["results"]}))

    done = here("verify", "result.json", "--ground-truth", "truth.json")
    told = json.loads(here("verify", "result.json", "--ground-truth", "truth.json", "--json").stdout)

    assert done.stdout.startswith("verified but for the answer, which is the solution's own  ")
    assert "score (OMQ 1.0000)" in done.stdout
    assert told["results"][0]["not_proven"] == ["the answer, which is the solution's own"]
    assert told["results"][0]["scores"]["OMQ"] == 1.0


def test_what_cannot_be_verified_is_told_apart_from_what_is_wrong(result_folder: CommandLine, here: Here) -> None:
    done = here("verify", "perfect.json", "broken.json", "truth.json")

    assert done.returncode == 2
    assert done.stdout.splitlines() == [
        "unverifiable  arena:1  perfect.json",
        "unverifiable  arena:1  broken.json",
        "unverifiable  truth.json",
    ]
    assert "It says nothing of what made it: it is of BenchBot v2, or of another program." in done.stderr


def test_the_bundle_of_an_example_holds_no_other_examples(cli: CommandLine, here: Here) -> None:
    done = cli("submit", "--example", "hello_passive", *SELECTION, "-r", "result.json")
    assert done.returncode == 0, done.stderr

    done = here("bundle", "result.json", "--example", "hello_passive", "-o", "one.zip", "--json")

    assert done.returncode == 0, done.stderr
    packed = {name for name in json.loads(done.stdout)["files"] if name.startswith("solution/")}
    assert packed == {"solution/hello_passive.py", "solution/hello_passive.yaml"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["reproduce", "nothing.zip"], "Cannot read nothing.zip."),
        (["reproduce", "perfect.json"], "perfect.json is not a sound bundle."),
        (["reproduce", "perfect.json", "-r", "empty.json"], "empty.json is not a folder."),
        (["bundle", "perfect.json"], "It is not clear which solution made the results."),
        (["bundle", "perfect.json", "--solution", "empty.json"], "perfect.json does not say what made it."),
        (["bundle", "perfect.json", "--solution", "."], "truth.json must not be given away."),
        (["bundle", "perfect.json", "--solution", "nowhere"], "There is no nowhere."),
        (["bundle", "truth.json", "--solution", "empty.json"], "It holds a ground truth."),
        (["bundle", "perfect.json", "--example", "hello"], "'hello' is not"),
        (["verify", "nothing.json"], "nothing.json: nothing.json is not a result. There is no such file."),
    ],
)
def test_wrong_usage_is_told_with_the_way_out(
    result_folder: CommandLine, here: Here, words: list[str], message: str
) -> None:
    done = here(*words)

    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_an_interrupted_reproduction_leaves_nothing_behind(cli: CommandLine, here: Here) -> None:
    script = cli.script("solution.py", PASSIVE)
    cli.script("hanging.py", HANGING)
    assert here("submit", "--native", script, *SELECTION, "-r", "result.json").returncode == 0
    words = ["--solution", ".", "--leave-out", "result.json", "--command", "python hanging.py"]
    assert here("bundle", "result.json", *words).returncode == 0

    reproducing = cli.start("reproduce", "bundle.zip")
    wait_for(reproducing, "hanging")
    reproducing.send_signal(signal.SIGINT)

    assert ended(reproducing) == 130
    assert cli.nothing_is_left()
    assert [path for path in cli.home.iterdir() if path.name.startswith("benchbot-")] == []


def test_a_stranger_s_solution_is_not_run_natively_without_consent(cli: CommandLine, here: Here) -> None:
    script = cli.script("solution.py", PASSIVE)
    assert here("submit", "--native", script, *SELECTION, "-r", "result.json").returncode == 0
    assert here("bundle", "result.json", "--solution", "solution.py").returncode == 0

    done = here("reproduce", "bundle.zip", "--native")
    looked = here("reproduce", "bundle.zip", "--check-only")

    assert done.returncode == 2
    assert "would run with all your rights, as: python solution.py" in done.stderr
    assert (looked.returncode, looked.stdout) == (0, "")
    assert len(list((cli.home / "state" / "runs").iterdir())) == 1
