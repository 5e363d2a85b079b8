import hashlib
import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from tests.cli.solutions import PASSIVE, WORDS, WRITES
from tests.cli.submitted import SELECTION, read
from tests.command_line import CommandLine, Here, wait_for


def test_one_command_runs_everything_and_leaves_a_result_and_nothing_else(cli: CommandLine) -> None:
    done = cli("submit", "--native", cli.script("solution.py", PASSIVE), *SELECTION, "--seed", "7", "-r", "result.json")

    assert done.returncode == 0, done.stderr
    assert done.stdout == "result.json\n"
    provenance = read(cli.folder / "result.json")["provenance"]
    assert provenance["failure"] is None
    assert provenance["steps"] == 3
    assert provenance["selection"]["seed"] == 7
    (script, digest), *others = provenance["solution"]["files"].items()
    assert (script, others) == (provenance["solution"]["command"][-1], [])
    assert digest == hashlib.sha256((cli.folder / "solution.py").read_bytes()).hexdigest()
    assert cli.nothing_is_left()
    assert [path.name for path in cli.folder.iterdir() if path.name.startswith(".")] == []


def test_a_result_names_no_content_of_a_file_that_was_edited_while_the_solution_ran(cli: CommandLine) -> None:
    edits = "import os, pathlib\npath = pathlib.Path(__file__)\ntext = path.read_text()\nbefore = path.stat()\n"
    restores = "path.write_text('edited')\npath.write_text(text)\n"
    restores += "os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))\n"
    solution = cli.script("solution.py", edits + restores + PASSIVE)

    done = cli("submit", "--native", solution, *SELECTION, "-r", "result.json")

    assert done.returncode == 0, done.stderr
    assert "Changed while it ran, so the result does not say of which content it is: " in done.stderr
    ran = read(cli.folder / "result.json")["provenance"]["solution"]
    assert (ran["files"], ran["changed_files"]) == ({}, [str(cli.folder / "solution.py")])
    refused = cli("bundle", "result.json", "--solution", "solution.py")
    assert refused.returncode == 2
    assert "was changed while the solution ran." in refused.stderr


def test_the_device_is_said_at_the_start_kept_with_the_result_and_must_be_there(cli: CommandLine) -> None:
    solution = cli.script("solution.py", PASSIVE)

    done = cli("submit", "--native", solution, *SELECTION, "-r", "result.json")

    assert done.returncode == 0, done.stderr
    assert "Device       cpu\n" in done.stderr
    assert read(cli.folder / "result.json")["provenance"]["machine"]["device"] == "cpu"
    refused = cli("submit", "--native", solution, *SELECTION, "--device", "cuda", "-r", "other.json")
    assert refused.returncode == 2
    assert "There is no GPU here." in refused.stderr
    assert cli.nothing_is_left()


def test_what_was_set_is_in_the_result(cli: CommandLine) -> None:
    settings = ["--set", "lighting.time=21:30", "--set", "lighting.lamps.on=[lamp_1]"]

    done = cli("submit", "--native", cli.script("solution.py", PASSIVE), *SELECTION, *settings, "-r", "result.json")

    assert done.returncode == 0, done.stderr
    selection = read(cli.folder / "result.json")["provenance"]["selection"]
    assert selection["settings"] == {"lighting.lamps.on": ["lamp_1"], "lighting.time": "21:30"}


def test_the_words_of_the_command_are_collected_and_never_seen_by_a_shell(cli: CommandLine) -> None:
    script = cli.script("words.py", WORDS).split()[1]

    done = cli("submit", "-n", sys.executable, script, "$HOME;", "--args", "'two words' last", *SELECTION, "--json")

    assert done.returncode == 0, done.stderr
    assert 'words: ["$HOME;", "two words", "last"]' in done.stderr
    assert json.loads(done.stdout)["provenance"]["solution"]["command"][1:] == [script, "$HOME;", "two words", "last"]


def test_an_example_runs_by_its_name(cli: CommandLine) -> None:
    done = cli("submit", "--example", "hello_passive", *SELECTION)

    assert done.returncode == 0, done.stderr
    assert read(Path(done.stdout.strip()))["results"]["objects"] == []


def test_two_terminals_and_the_same_seed_give_the_same_bytes(cli: CommandLine) -> None:
    solution = cli.script("solution.py", PASSIVE)
    back_end = cli.start("run", "-t", "sample:passive", "-r", "sample_robot", "-e", "arena:1", "--port", "0")
    wait_for(back_end, "Ready.")

    first = cli("submit", "--native", solution, "-r", "first.json")
    second = cli("submit", "--native", solution, "-r", "second.json")
    stopped = cli("stop")

    assert (first.returncode, second.returncode, stopped.returncode) == (0, 0, 0), first.stderr + second.stderr
    assert (cli.folder / "first.json").read_bytes() == (cli.folder / "second.json").read_bytes()
    assert back_end.wait(30) == 0
    assert cli.nothing_is_left()


def test_of_a_long_log_the_beginning_and_the_end_are_kept(cli: CommandLine) -> None:
    talks = "for number in range(20000):\n    print('line', number)\n"
    back_end = cli.start("run", "-t", "sample:passive", "-r", "sample_robot", "-e", "arena:1", "--port", "0")
    folder = Path(wait_for(back_end, "Logs").split()[-1])
    wait_for(back_end, "Ready.")

    done = cli("submit", "--native", cli.script("solution.py", talks + PASSIVE), "--log-limit", "8KiB", "-r", "r.json")
    log = (folder / "solution.log").read_text("utf-8")
    cli("stop")

    assert done.returncode == 0, done.stderr
    assert log.startswith("line 0\nline 1\n")
    assert "\nline 19999\n" in log
    assert "bytes are left out here: --log-limit is 8 KiB" in log
    assert "--log-limit much is no size." in cli("submit", "--native", "true", "--log-limit", "much").stderr


def test_without_a_back_end_the_way_to_one_is_told(here: Here) -> None:
    done = here("submit", "--native", "true")

    assert done.returncode == 2
    assert "benchbot run --task TASK --robot ROBOT --env ENVIRONMENT" in done.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "No solution was given."),
        (["--native", "true", "--example", "hello_passive"], "--native and --example were given."),
        (["--example", "hello_pasive"], "Did you mean 'hello_passive'?"),
        (["--native", "no_such_program"], "no_such_program: there is no such program on PATH."),
        (["--native", " "], "there is no command"),
        (["--native", "'open"], "No closing quotation"),
        (["--native", "true", "--task", "sample:passive"], "--robot and --env are missing."),
        (["--native", "true", "-e", "omg"], "'omg' is not an installed evaluator."),
        (["--native", "true", "--require", "OMQ>=0.4"], "There will be no score."),
        (["--native", "true", "-e", "omq", "--require", "OMQ"], "'OMQ' is not a requirement."),
        (
            ["--native", "true", "--seed", "0"],
            "has a device, episode, settings, seed, secret, limits, recordings and diagnosis",
        ),
        (
            ["--native", "true", "--set", "assets=own"],
            "has a device, episode, settings, seed, secret, limits, recordings and diagnosis",
        ),
        (
            ["--native", "true", "--episode", "1"],
            "has a device, episode, settings, seed, secret, limits, recordings and diagnosis",
        ),
        (["--native", "true", *SELECTION, "--episode", "1"], "The task 'sample:passive' has no episodes."),
        (["--native", "true", "-r", "/dev/null"], "/dev/null is not a file."),
        (["--native", "true", *SELECTION[:-1], "arena:1:2"], "The task 'sample:passive' needs 1 scene, not 2."),
    ],
)
def test_a_wrong_command_is_refused_before_anything_starts(
    words: list[str], message: str, cli: CommandLine, here: Here
) -> None:
    done = here("submit", *words)

    assert done.returncode == 2
    assert done.stdout == ""
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert not (cli.home / "state" / "runs").exists() or list((cli.home / "state" / "runs").iterdir()) == []


@pytest.fixture
def with_ground_truth(cli: CommandLine, make_plugin: Callable[..., Path]) -> CommandLine:
    """A command line whose arena:1 has a ground truth: one bottle."""
    sample = Path(__file__).parents[1] / "sample_plugin" / "benchbot_sample"
    bottle = {"class": "bottle", "ID_name": "b", "centroid": [0, 0, 0.5], "extent": [1, 1, 1], "isgroup": False}
    ground_truth = {
        "environment": yaml.safe_load((sample / "environments" / "arena_1.yaml").read_text()),
        "format": {"name": "object_map_ground_truth", "functions": {"create": "json:loads"}},
        "ground_truth": {"objects": [bottle], "class_list": ["bottle", "background"], "synonyms": {}},
    }
    code = (
        "from importlib.resources import files\nfrom benchbot.plugin import hookimpl\n\n@hookimpl\n"
        "def benchbot_ground_truths():\n    yield files(__name__) / 'truths'\n"
    )
    make_plugin("truths", code, {"truths/arena_1.json": json.dumps(ground_truth)})
    return cli


def perfect(cli: CommandLine) -> str:
    bottle = {"label_probs": [1, 0], "centroid": [0, 0, 0.5], "extent": [1, 1, 1]}
    text = json.dumps({"results": {"class_list": ["bottle", "background"], "objects": [bottle]}})
    return cli.script("solution.py", WRITES.format(text=text))


def test_the_score_comes_right_after_the_submission(with_ground_truth: CommandLine) -> None:
    cli = with_ground_truth

    done = cli(
        "submit", "--native", perfect(cli), *SELECTION, "-r", "result.json", "-e", "omq", "--require", "OMQ>=0.9"
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout == "OMQ 1.0000\n"
    assert json.loads((cli.folder / "scores.json").read_text())["scores"]["OMQ"] == pytest.approx(1.0)


def test_a_score_below_the_threshold_exits_with_4_and_is_kept(with_ground_truth: CommandLine) -> None:
    cli = with_ground_truth

    done = cli(
        "submit",
        "--example",
        "hello_passive",
        *SELECTION,
        "-r",
        "kept/",
        "-e",
        "omq",
        "-o",
        "s.json",
        "--require",
        "OMQ>=0.4",
    )

    assert done.returncode == 4
    assert done.stdout == "OMQ 0.0000\n"
    assert "OMQ >= 0.4 is required; the score is 0." in done.stderr
    assert (cli.folder / "s.json").exists()


def test_everything_is_told_as_json(with_ground_truth: CommandLine) -> None:
    done = with_ground_truth("submit", "--native", perfect(with_ground_truth), *SELECTION, "-e", "omq", "--json")

    summary = json.loads(done.stdout)
    assert summary["scores"]["OMQ"] == pytest.approx(1.0)
    assert summary["error"] is None
    assert Path(summary["result_path"]).exists()
    assert Path(summary["scores_path"]).exists()


MARKED = """
import os, sys
from contextlib import contextmanager
from dataclasses import dataclass, replace
from benchbot.plugin import NATIVE, BenchbotError, SubmissionMode, hookimpl

PLUGIN_API = 1

@hookimpl
def benchbot_submission_modes():
    yield SubmissionMode("marked", "marking", "Tells the solution a word.")

@dataclass(frozen=True)
class Marked:
    name = "marked"
    needs_socket = False
    word: str

    def describe(self):
        return f"marked {self.word}"

    def check(self):
        pass

    def start(self, spec, connection, exchange, output):
        marked = replace(spec, variables={**spec.variables, "MARK": self.word})
        return NATIVE.start(marked, connection, exchange, output)

def resolved(options):
    if set(options) != {"word"}:
        raise BenchbotError("No word.", "The mode needs one.", "Give it: --mode-option word=hello")
    return dict(options)

@contextmanager
def prepared(spec, options, tell):
    yield replace(spec, mode=Marked(options["word"]))

def files(options):
    return None
"""


def test_a_plugin_brings_a_mode(cli: CommandLine, make_plugin: Callable[..., Path]) -> None:
    make_plugin("marking", MARKED)
    code = PASSIVE + "import os; print('the mark is', os.environ['MARK'])"
    submit = [
        "submit",
        "--native",
        cli.script("solution.py", code),
        *SELECTION,
        "-r",
        "result.json",
        "--mode",
        "marked",
    ]

    wrong = cli(*submit)
    done = cli(*submit, "--mode-option", "word=tango")

    assert "marked" in cli("list", "modes").stdout
    assert wrong.returncode == 2
    assert "--mode-option word=hello" in wrong.stderr
    assert done.returncode == 0, done.stderr
    assert "The solution runs marked tango." in done.stderr
    assert "the mark is tango" in done.stderr
    assert read(cli.folder / "result.json")["provenance"]["solution"]["mode"] == "marked"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--native", "true", "--mode-option", "word=x"], "Name it: --mode NAME"),
        (["--native", "true", "--mode", "native", "--mode-option", "word=x"], "Name it: --mode NAME"),
        (["--native", "true", "--mode", "cage"], "cage"),
        (["--native", "true", "--mode", "sandbox"], "--sandbox COMMAND"),
        (["--sandbox", "true", "--mode", "marked"], "--mode NAME --native COMMAND"),
    ],
)
def test_a_mode_that_is_not_clear_is_refused(cli: CommandLine, options: list[str], said: str) -> None:
    done = cli("submit", *options, *SELECTION)

    assert done.returncode != 0
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert cli.nothing_is_left()


def test_a_dry_run_says_what_would_run_and_starts_nothing(cli: CommandLine) -> None:
    done = cli("submit", "--dry-run", "--native", cli.script("solution.py", PASSIVE), *SELECTION, "-r", "result.json")
    refused = cli("submit", "--dry-run", "--example", "hello_passive", *SELECTION[:-1], "atlantis:1")

    assert done.returncode == 0, done.stderr
    assert "arena:1" in done.stderr
    assert not (cli.folder / "result.json").exists()
    assert cli.nothing_is_left()
    assert refused.returncode != 0
    assert "atlantis" in refused.stderr


def test_a_solution_is_not_told_where_the_truth_is(with_ground_truth: CommandLine) -> None:
    cli = with_ground_truth
    listing = "os.listdir(os.path.dirname(os.environ['BENCHBOT_RESULT']))"
    code = f"import os, sys; print(os.environ, sys.argv, {listing})"

    done = cli("submit", "--native", cli.script("solution.py", code), *SELECTION)

    assert "BENCHBOT_TOKEN" in done.stderr
    assert "ground_truth" not in done.stderr
    assert "arena_1.json" not in done.stderr
