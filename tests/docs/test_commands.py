"""Every command of the documentation is one that there is, and those of the README do what it says."""

import json
import re
from pathlib import Path

import pytest

from tests.docs.blocks import ROOT, pages
from tests.docs.commands import back_end, commands, succeed
from tests.docs.parsing import parsed

README = (ROOT / "README.md").read_text("utf-8")
PAGES = [path for path in pages() if commands(path.read_text("utf-8"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_command_on_a_page_is_one_that_there_is(page: Path) -> None:
    for command in commands(page.read_text("utf-8")):
        if "…" not in command:
            parsed(command)


def test_a_command_that_there_is_not_would_be_found() -> None:
    for wrong in ("benchbot fly", "benchbot list kites", "benchbot run --height 3", "benchbot eval"):
        with pytest.raises(Exception, match=r"No such|Missing|fly|kites"):
            parsed(wrong)


SOLUTION = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)[0]
# The camera of this robot is small: the same in a fraction of the time.
STEPS = [re.sub(r"\bcarter\b", "carter_lowres", command) for command in commands(README)]


def step(beginning: str) -> str:
    (command,) = [command for command in STEPS if command.startswith(beginning)]
    return command


@pytest.mark.slow
@pytest.mark.xdist_group("main job")
def test_the_three_steps_of_the_readme_lead_to_a_score(tmp_path: Path, kernel_cache: Path) -> None:
    """In two terminals, with the solution on the page, once somebody has filled in where its dots are."""
    solution = SOLUTION.replace(
        "        ...  # fill in", "        json.dump(empty_results, open(filename, 'w'))  # fill in"
    )
    (tmp_path / "my_solution.py").write_text(f"import json\n{solution}")
    with back_end(step("benchbot run"), tmp_path, kernel_cache) as environment:
        for kind in ("tasks", "robots", "environments"):
            assert "benchbot" in succeed(step(f"benchbot list {kind}"), tmp_path, environment).stdout
        succeed(step("benchbot submit --native python my_solution.py --results-location"), tmp_path, environment)
    assert json.loads((tmp_path / "result.json").read_text())["provenance"]["steps"] == 48
    assert succeed(step("benchbot eval"), tmp_path, environment).stdout == "OMQ 0.0000\n"


def test_what_else_the_readme_runs_is_run_by_other_tests() -> None:
    """So that nothing is run twice: the examples by test_examples.py, all three steps at once by test_main_job.py."""
    assert [command for command in STEPS if command.startswith("benchbot submit --example")] == [
        "benchbot submit --example hello_passive"
    ]
    all_three = step("benchbot submit --task semantic_slam:passive:ground_truth:segmentation")
    main_job = (ROOT / "tests" / "ray_tracing.py").read_text("utf-8")
    assert all(f'"{word}"' in main_job for word in all_three.split()[2:] if word != "result.json")
