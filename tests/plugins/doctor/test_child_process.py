import pytest

from benchbot.plugins.doctor import child_process


@pytest.mark.parametrize(
    ("code", "problem"),
    [
        ("import os; os.abort()", "signal 6"),
        ("raise OSError('no such driver')", "OSError: no such driver"),
        ("import sys; sys.exit(3)", "exit code 3"),
        ("import time; time.sleep(600)", "no answer within 1 s"),
        ("print('well')", ""),
    ],
)
def test_a_child_that_crashes_or_hangs_is_an_answer(code: str, problem: str) -> None:
    timeout_s = 1.0 if "sleep" in code else 120.0

    assert child_process.ask_python(code, bare=True, timeout_s=timeout_s).problem == problem


def test_a_program_that_is_not_there_is_an_answer() -> None:
    assert child_process.ask(["/no/such/program"]).problem == "No such file or directory"
