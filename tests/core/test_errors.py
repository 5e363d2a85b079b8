import pickle

import pytest

from benchbot.core.errors import BenchbotError, ExitCode, FailureClass, did_you_mean


def test_an_error_says_what_why_and_how_to_mend_it() -> None:
    error = BenchbotError("It broke.", "A part is missing.", "Put it back.", failure=FailureClass.PLATFORM)
    assert str(error) == "It broke.\nA part is missing.\nPut it back."
    assert error.as_dict() == {
        "title": "It broke.",
        "why": "A part is missing.",
        "fix": "Put it back.",
        "failure": "platform",
    }
    assert error.exit_code is ExitCode.USAGE


def test_an_error_of_another_process_says_the_same_here() -> None:
    error = BenchbotError("It broke.", "A part is missing.", "Put it back.", failure=FailureClass.AGENT, ends_run=True)

    again = pickle.loads(pickle.dumps(error))

    assert str(again) == str(error)
    assert (again.as_dict(), again.exit_code) == (error.as_dict(), error.exit_code)


def test_exit_codes_are_a_contract() -> None:
    assert {code.name: code.value for code in ExitCode} == {
        "OK": 0,
        "SUBMISSION_FAILED": 1,
        "USAGE": 2,
        "INTERNAL": 3,
        "BELOW_THRESHOLD": 4,
        "INTERRUPTED": 130,
    }


def test_a_near_miss_is_guessed_in_its_own_spelling() -> None:
    assert did_you_mean("cartr", ["Carter", "husky"]) == " Did you mean 'Carter'?"
    assert did_you_mean("zzz", ["Carter", "husky"]) == ""


@pytest.mark.parametrize("short", ["miniroom", "Miniroom"])
def test_a_short_name_is_guessed_as_the_first_that_goes_on_after_it(short: str) -> None:
    known = ["house:1", "miniroom:1", "miniroom:2", "miniroom:5", "miniroof"]
    assert did_you_mean(short, known) == " Did you mean 'miniroom:1'?"
