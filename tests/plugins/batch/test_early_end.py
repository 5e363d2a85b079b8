"""A batch that cannot become what was wanted ends early, and says why."""

import json
import subprocess
import sys

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.batch.early_end import failure_limit
from benchbot.plugins.batch.error_groups import ErrorGroup, cause, grouped, lines
from tests.cli.solutions import CRASHING, PASSIVE
from tests.plugins.batch.conftest import Batches, wait_until

LACKS_A_MODULE = """\
import os
if not os.path.exists({installed!r}):
    import torch_of_tomorrow
"""
SAVES_NOTHING = """\
from benchbot.api import BenchBot
BenchBot().step("move_next")
"""
FAILS_AFTER = """\
import os, sys, time
from benchbot.api import BenchBot
BenchBot().step("move_next")
sys.exit(f"error {os.getpid()}")
"""


WAITS = """\
import os, time
while not os.path.exists({go!r}):
    time.sleep(0.05)
"""


def with_solution(batches: Batches, code: str, name: str = "other.py") -> Batches:
    return Batches(batches.cli, batches.cli.script(name, code))


def test_a_solution_that_cannot_begin_ends_the_batch_after_one_episode_and_goes_on_when_it_is_mended(
    batches: Batches,
) -> None:
    # Not where the solution lies: all that is there belongs to it.
    installed = batches.cli.home / "installed"
    broken = with_solution(batches, LACKS_A_MODULE.format(installed=str(installed)) + PASSIVE)

    ended = broken.run("b", "--jobs", "2")
    again = broken.run("b", "--jobs", "2")
    begun = broken.told("b", "began")
    status = broken.cli("batch", "status", "b")
    installed.touch()
    mended = broken.run("b", "--jobs", "2")

    assert (ended.returncode, again.returncode) == (1, 1)
    assert "The first episode failed as all others would: the batch was ended." in ended.stderr
    assert "ModuleNotFoundError: No module named 'torch_of_tomorrow'" in ended.stderr
    assert "python -m pip install torch_of_tomorrow" in ended.stderr
    assert begun == 2, "the second time it is computed anew, and nothing else either time"
    assert "1 episode: ModuleNotFoundError: No module named 'torch_of_tomorrow'" in status.stdout
    assert mended.returncode == 0, mended.stderr
    assert all('"failure": null' in text for text in broken.results("b").values()), "no false zero is left"


def test_a_solution_that_saves_nothing_ends_it_too_unless_that_is_wanted(batches: Batches) -> None:
    silent = with_solution(batches, SAVES_NOTHING)

    ended = silent.run("b")
    wanted = silent.run("b", "--no-canary")

    assert ended.returncode == 1
    assert "The solution saved no result." in ended.stderr
    assert wanted.returncode == 1
    assert len(silent.results("b")) == 4
    assert "4 episodes: The solution saved no result." in wanted.stderr


def test_those_that_wait_for_the_canary_have_their_place_loaded_when_they_may_begin(batches: Batches) -> None:
    go = batches.cli.folder / "go"
    waiting = with_solution(batches, WAITS.format(go=str(go)) + PASSIVE)

    process = waiting.cli.start(*waiting.words("b", "--jobs", "2"))
    wait_until(lambda: len(batches.processes("benchbot.supervisor ")) == 2)
    begun, loaded = waiting.told("b", "began"), batches.processes("benchbot.supervisor ")
    go.touch()
    wait_until(lambda: waiting.told("b", "began") >= 3)
    still = batches.processes("benchbot.supervisor ")
    process.communicate(timeout=120)

    assert begun == 1
    assert still == loaded, "each goes on where it has loaded a place"
    assert process.returncode == 0


def test_workers_without_a_driver_end_at_a_failed_canary(batches: Batches) -> None:
    broken = with_solution(batches, LACKS_A_MODULE.format(installed="nowhere"))
    broken.run("b")
    worker = [sys.executable, "-m", "benchbot.plugins.batch.worker", str(batches.path("b")), "--name", "lonely"]

    alone = subprocess.run(worker, env=batches.cli.variables, capture_output=True, text=True, check=False, timeout=120)

    assert alone.returncode == 3
    assert "The first episode failed as all others would" in alone.stderr
    assert len(broken.results("b")) == 1


def test_a_crash_under_way_and_a_batch_of_one_episode_end_nothing(batches: Batches) -> None:
    crashing = with_solution(batches, CRASHING, "crashing.py")
    alone = with_solution(batches, LACKS_A_MODULE.format(installed="nowhere"))

    assert crashing.run("crashing").returncode == 1
    assert len(crashing.results("crashing")) == 4
    assert alone.run("alone", seeds="0", envs="arena:1").returncode == 1
    assert len(alone.results("alone")) == 1


def test_so_many_failures_end_the_batch(batches: Batches) -> None:
    failing = with_solution(batches, FAILS_AFTER)

    counted = failing.run("counted", "--jobs", "1", "--fail-on-error", "2", seeds="0..5")
    again = failing.run("counted", "--jobs", "1", "--fail-on-error", "2", seeds="0..5")
    part = failing.run("part", "--jobs", "1", "--fail-on-error", "25%", seeds="0..5")

    assert (counted.returncode, part.returncode) == (1, 1)
    assert "of 12 episodes failed: the batch was ended." in counted.stderr
    assert "It was to end at 2 (--fail-on-error 2)." in counted.stderr
    assert "It was to end at 3 (--fail-on-error 0.25)." in part.stderr
    assert "retry" in counted.stderr
    assert 2 <= len(failing.results("counted")) <= 4
    assert again.returncode == 1
    assert len(failing.results("counted")) <= 4


def test_equal_errors_are_one_line_with_one_fix(batches: Batches) -> None:
    failing = with_solution(batches, FAILS_AFTER)

    done = failing.run("b")
    status = json.loads(failing.cli("batch", "status", "b", "--json").stdout)

    assert "4 episodes: error " in done.stderr
    assert "benchbot batch logs" in done.stderr
    (group,) = status["errors"]
    assert (group["count"], group["failure"]) == (4, "agent")


def test_errors_that_differ_in_numbers_only_are_equal() -> None:
    failed = [("agent", f"KeyError: {number}", f"e{number}") for number in range(7)]
    failed += [("timeout", "KeyError: 7", "late"), ("agent", "ModuleNotFoundError: No module named 'torch.cuda'", "m")]

    groups = grouped(failed)

    assert groups[0] == ErrorGroup(7, "agent", "KeyError: 0", "e0")
    assert [group.count for group in groups] == [7, 1, 1]
    assert "python -m pip install torch" in "\n".join(lines(groups, "folder"))
    assert "7 episodes: KeyError: 0" in lines(groups, "folder")
    assert sum(group.count for group in groups) == len(failed)


def test_only_the_first_groups_are_shown_and_the_others_counted() -> None:
    groups = grouped(("agent", f"error {'abcdefgh'[number]}", "e") for number in range(8))

    assert lines(groups, "folder")[-1] == "3 more, of 3 other errors"


def test_the_cause_is_the_last_line() -> None:
    why = "The solution failed. It ended with exit status 1.\nTraceback …\n  x = 1\nValueError: no\n\n"
    assert cause(why) == "ValueError: no"
    assert cause("") == ""


@pytest.mark.parametrize(("text", "limit"), [("5", 5), ("0.1", 0.1), ("10%", 0.1), ("1.0", 1.0), (3, 3), (0.5, 0.5)])
def test_a_limit_is_a_number_or_a_part(text: object, limit: float) -> None:
    found = failure_limit(text)
    assert (found, type(found)) == (limit, type(limit))


@pytest.mark.parametrize("text", ["0", "-1", "1.5", "120%", "nan", "", "many", 0, 2.5])
def test_what_is_neither_is_refused(text: object) -> None:
    with pytest.raises(BenchbotError, match="says not when"):
        failure_limit(text)
