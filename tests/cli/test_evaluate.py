import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.command_line import CommandLine, Here


def test_a_result_is_scored_by_the_method_that_fits_it(result_folder: CommandLine, here: Here) -> None:
    done = here("eval", "perfect.json", "--ground-truth", "truth.json")

    assert done.returncode == 0, done.stderr
    assert done.stdout == "OMQ 1.0000\n"
    assert "arena:1  1.0000" in done.stderr
    assert json.loads((result_folder.folder / "scores.json").read_text())["scores"]["OMQ"] == pytest.approx(1.0)


def test_many_results_make_one_score_and_what_is_missing_is_told(result_folder: CommandLine, here: Here) -> None:
    with zipfile.ZipFile(result_folder.folder / "all.zip", "w") as archive:
        archive.write(result_folder.folder / "empty.json", "empty.json")

    done = here("eval", "perfect.json", "all.zip", "--ground-truth", "truth.json", "-o", "out.json", "--json")

    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document == json.loads((result_folder.folder / "out.json").read_text())
    assert document["scores"]["OMQ"] == pytest.approx(0.5)


@pytest.mark.usefixtures("result_folder")
def test_a_required_environment_without_a_result_counts_as_zero(here: Here) -> None:
    done = here(
        "eval",
        "perfect.json",
        "--ground-truth",
        "truth.json",
        "--required-envs",
        "arena:1,arena:2",
        "--require",
        "OMQ>0.5",
    )

    assert done.returncode == 4
    assert done.stdout == "OMQ 0.5000\n"
    assert "1 of 2 scored; the missing count as zero" in done.stderr
    assert "missing: arena:2" in done.stderr


def test_validating_scores_nothing(result_folder: CommandLine, here: Here) -> None:
    sound = here("eval", "-V", "perfect.json", "empty.json")
    broken = here("eval", "--validate-only", "perfect.json", "broken.json", "--json")

    assert (sound.returncode, sound.stdout) == (0, "")
    assert "2 of 2 valid" in sound.stderr
    assert broken.returncode == 1
    assert [item["source"] for item in json.loads(broken.stdout)["missing"]] == ["broken.json"]
    assert not (result_folder.folder / "scores.json").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["no.json"], "no.json"),
        (["broken.json"], "objects[0]"),
        (["perfect.json", "--method", "omg"], "'omg' is not an installed evaluator."),
        (["perfect.json", "--required-task", "sample:pasive"], "Did you mean 'sample:passive'?"),
        (["perfect.json", "--required-envs", "arena:7"], "'arena:7' is not a known environment."),
        (["perfect.json", "--required-envs-batch", "b"], "'b' is not a known batch."),
        (["perfect.json", "--required-envs-batch", "b", "--required-envs", "arena:1"], "exclude each other"),
        (["perfect.json", "-o", "/dev/null"], "/dev/null is not a file."),
        (["perfect.json", "--require", "OMG>0"], "There is no score 'OMG'."),
        ([], "Missing argument"),
    ],
)
@pytest.mark.usefixtures("result_folder")
def test_what_cannot_be_scored_is_told_and_nothing_is_written(words: list[str], message: str, here: Here) -> None:
    done = here("eval", *words, *(["--ground-truth", "truth.json"] if words else []))

    assert done.returncode in (1, 2)
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_a_batch_names_the_required_environments(result_folder: CommandLine, make_plugin: Callable[..., Path]) -> None:
    code = (
        "from importlib.resources import files\nfrom benchbot.plugin import hookimpl\n\n@hookimpl\n"
        "def benchbot_batches():\n    yield files(__name__) / 'batches'\n"
    )
    make_plugin("batches", code, {"batches/all.yaml": "name: all\nenvironments: ['arena:1', 'arena:2']\n"})

    done = result_folder("eval", "perfect.json", "--ground-truth", "truth.json", "--required-envs-batch", "all")

    assert done.stdout == "OMQ 0.5000\n"
    assert "all" in result_folder("eval", "--list-batches").stdout
    assert "arena:2" in result_folder("eval", "--show-batch", "all").stdout
