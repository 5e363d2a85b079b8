import json
import os
from pathlib import Path

import pytest

from benchbot.plugins.v2.plugin import _take_options as take
from tests.command_line import COMMAND, CommandLine, Here
from tests.terminal import asked
from tests.v2_addon import make

SELECTION = ["--task", "count:passive:ground_truth", "--robot", "sample_robot", "--env", "hall:1"]


@pytest.fixture
def folder(cli: CommandLine, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_ADDONS", "")  # what commands in this process set ends with the test
    return make(cli.folder / "addons")


def test_an_addon_runs_from_its_task_to_its_score(folder: Path, cli: CommandLine) -> None:
    done = cli(
        *("submit", "--addons", "addons", "--trust-addons", "--example", "count_bottles", *SELECTION),
        *("--evaluate-with", "count_error", "-r", "result.json"),
    )

    assert done.returncode == 0, done.stderr
    assert done.stdout == "exact 0.5000\n"
    result = json.loads((cli.folder / "result.json").read_text())
    assert result["results"]["counts"] == {"bottle": 1}
    assert result["provenance"]["plugins"]["work/addons"]["version"] == "v2"
    assert len(result["provenance"]["plugins"]["work/addons"]["sha256"]) == 64
    assert result["task_details"]["type"] == "sim_unreal"
    assert not (folder / "executed").exists()
    assert [path for path in folder.rglob("__pycache__") if "examples" not in str(path)] == []
    assert cli.nothing_is_left()


def test_results_are_scored_over_a_batch_of_an_addon_named_by_the_variable(folder: Path, cli: CommandLine) -> None:
    cli.variables["BENCHBOT_ADDONS"] = str(folder)
    submitted = cli("submit", "--trust-addons", "--example", "count_bottles", *SELECTION, "-r", "r.json")
    done = cli("eval", "r.json", "--required-envs-batch", "halls", "--required-task", SELECTION[1])

    assert submitted.returncode == 0, submitted.stderr
    assert (done.returncode, done.stdout) == (0, "exact 0.5000\n"), done.stderr
    scores = json.loads((cli.folder / "scores.json").read_text())
    assert scores["method"]["headline"] == "exact"
    assert scores["method"]["version"].startswith("v2-")


def test_a_solution_is_not_told_where_the_addons_are(folder: Path, cli: CommandLine) -> None:
    script = cli.script("spy.py", "import os; print('seen:', os.environ.get('BENCHBOT_ADDONS'))")

    done = cli("submit", "--native", script, *SELECTION, BENCHBOT_ADDONS=str(folder))
    assert "is not trusted" in done.stderr
    done = cli("submit", "--trust-addons", "--native", script, *SELECTION, BENCHBOT_ADDONS=str(folder))

    assert "seen: None" in done.stderr


def test_a_result_that_breaks_the_format_is_refused_in_the_words_of_the_format(folder: Path, cli: CommandLine) -> None:
    text = json.dumps({"results": {"counts": {"ghost": 1}, "class_list": []}})
    script = cli.script("wrong.py", f"import os; open(os.environ['BENCHBOT_RESULT'], 'w').write({text!r})")

    done = cli("submit", "--addons", "addons", "--trust-addons", "--native", script, *SELECTION)

    assert done.returncode == 1
    assert "The result breaks the format 'counts'" in done.stderr
    assert "'ghost' is not in class_list (me/formats_count/formats/counts.py:14)" in done.stderr


def test_untrusted_code_is_refused_before_anything_runs(folder: Path, here: Here, cli: CommandLine) -> None:
    for file in folder.rglob("count*.py"):
        file.write_text(f"open({str(folder / 'executed')!r}, 'w')\n{file.read_text()}")

    done = here("submit", "--addons", "addons", "--example", "count_bottles", *SELECTION)
    method = here("submit", "--addons", "addons", "--native", "true", "-e", "count_error")

    for refused in (done, method):
        assert refused.returncode == 2
        assert f"The code of the add-ons in {folder} is not trusted." in refused.stderr
        assert "give --trust-addons once" in refused.stderr
    assert not (folder / "executed").exists()


def test_trust_is_remembered_until_the_code_changes(folder: Path, here: Here) -> None:
    method = ("submit", "--addons", "addons", "--native", "true", "--evaluate-with", "count_error")
    assert "is not trusted" in here(*method).stderr
    here(*method, "--trust-addons")
    assert "is not trusted" not in here(*method).stderr

    with (folder / "me/eval_count/evaluation_methods/kinds.py").open("a") as file:
        file.write("# other\n")
    assert "is not trusted" in here(*method).stderr


def test_lists_and_shows_name_the_folder_and_run_no_code(folder: Path, here: Here) -> None:
    for file in folder.rglob("*.py"):
        file.write_text("raise SystemExit")

    tasks = here("list", "tasks", "--addons", "addons")
    line = next(line for line in tasks.stdout.splitlines() if line.startswith("count:"))
    assert line.split() == ["count:passive:ground_truth", "move_next", "ground_truth", "1", "counts", str(folder)]
    environments = here("list", "environments", "--addons", "addons").stdout
    assert ["hall:2", "sim_omni", "1", str(folder)] in [line.split() for line in environments.splitlines()]
    assert "count_error" in here("list", "methods", "--addons", "addons").stdout
    assert "count_bottles" in here("submit", "--list-examples", "--addons=addons").stdout
    assert f"# {folder}/me/tasks_count/tasks/count.yaml" in here("show", "task", SELECTION[1]).stdout
    assert "- counts_ground_truth" in here("show", "method", "count_error", "--addons", "addons").stdout


def test_a_broken_file_is_named_and_left_out(folder: Path, here: Here) -> None:
    (folder / "me/tasks_count/tasks/bad.yaml").write_text("name: x\nactions: [")

    done = here("list", "tasks", "--addons", "addons")

    assert "count:passive:ground_truth" in done.stdout
    assert f"Left out: {folder}/me/tasks_count/tasks/bad.yaml:3: not valid YAML." in done.stderr


def test_a_broken_function_is_named_before_anything_runs(folder: Path, here: Here) -> None:
    (folder / "me/formats_count/formats/counts.py").write_text("def create():\n    return {\n")

    done = here("submit", "--addons", "addons", "--trust-addons", "--native", "true", *SELECTION)

    assert done.returncode == 2
    assert "formats/counts.py cannot be imported." in done.stderr
    assert "'{' was never closed (me/formats_count/formats/counts.py:2)" in done.stderr


def test_a_folder_of_addons_can_be_checked(folder: Path, here: Here) -> None:
    done = here("check", "addons")
    assert done.returncode == 0
    assert all("warning: 'sim_omni' is none of the " in line for line in done.stdout.splitlines())

    method = folder / "me/eval_count/evaluation_methods/count_error.yaml"
    method.write_text(method.read_text().replace("valid_result_formats", "valid_results_formats"))
    assert "count_error.yaml:3: unknown key 'valid_results_formats'. Did you mean" in here("check", "addons").stdout


def test_a_result_is_checked_with_the_formats_of_addons(folder: Path, here: Here, cli: CommandLine) -> None:
    result = {
        "task_details": {"name": "t", "results_format": "counts"},
        "environment_details": [{"name": "hall", "variant": 1}],
        "results": {"counts": {"ghost": 1}, "class_list": []},
    }
    (cli.folder / "result.json").write_text(json.dumps(result))

    done = here("check", "--addons", "addons", "--trust-addons", "result.json")

    assert "'ghost' is not in class_list" in done.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["list", "tasks", "--addons", "nowhere"], "There are no add-ons in nowhere."),
        (["submit", "--trust-addons", "--native", "true"], "There are no add-ons to trust."),
        (["list", "tasks", "--addons"], "--addons names no folder."),
        (["list", "tasks", "--addons="], "--addons names no folder."),
    ],
)
def test_wrong_use_is_told(words: list[str], message: str, here: Here) -> None:
    done = here(*words)

    assert (done.returncode, message in done.stderr) == (2, True), done.stderr


def test_words_of_a_solution_are_left_alone(folder: Path) -> None:
    words = ["-n", "x", "--", "--addons", "nowhere", "--trust-addons"]

    assert take(words) == words
    assert os.environ["BENCHBOT_ADDONS"] == ""


@pytest.mark.parametrize(("answer", "allowed"), [("y", True), ("n", False)])
def test_on_a_terminal_the_user_is_asked(answer: str, allowed: bool, folder: Path, cli: CommandLine) -> None:
    words = ["submit", "--addons", "addons", "--native", "no_such_program", "-e", "count_error"]
    status, seen = asked([*COMMAND, *words], answer, cli.variables, cli.folder)

    assert status == 2
    assert "me/eval_count/evaluation_methods/count_error.py" in seen
    assert ("is not trusted" in seen) is not allowed
    assert "no such program" in seen  # all that is wrong is told at once
    assert any((cli.home / "state").rglob("trusted/*")) is allowed
