from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.core.request import Limits, RunRequest
from benchbot.plugins.tui import forms
from benchbot.plugins.tui.forms import SubmissionOptions, request_words, run_words, submit_words

RUN = RunRequest("t", "r", "e:1", seed=3, limits=Limits(steps=5))
RESULT = Path("/somewhere/result.json")


def test_a_run_is_told_what_was_chosen_and_nothing_else() -> None:
    assert run_words(RUN) == ["run", "--task=t", "--robot=r", "--env=e:1", "--seed=3", "--max-steps=5", "--port=0"]


def test_a_solution_brings_its_own_back_end_or_joins_a_run() -> None:
    solution = SubmissionOptions(RESULT, example="hello", method="omq", sandboxed=True, arguments="a b")

    alone = submit_words(solution)
    with_run = submit_words(solution, RUN)

    assert alone[0] == "submit"
    assert set(alone) > {"--example=hello", "--evaluate-with=omq", "--sandboxed", "--args=a b", "--json"}
    assert with_run == [*alone, *request_words(RUN)]


@given(st.text(min_size=1).filter(str.strip))
def test_a_command_stays_one_word_whatever_is_in_it(command: str) -> None:
    words = SubmissionOptions(RESULT, command=command).words()

    assert [word for word in words if word.startswith("--native=")] == [f"--native={command}"]
    assert not [word for word in words if not word.startswith("--")]


@pytest.mark.parametrize("command", [None, "", "  "])
def test_nothing_cannot_be_submitted(command: str | None) -> None:
    with pytest.raises(BenchbotError, match="nothing to submit"):
        SubmissionOptions(RESULT, command=command).words()


@given(st.one_of(st.text(), st.integers().map(str), st.floats().map(str)))
def test_a_field_is_a_number_that_counts_or_an_error_that_names_it(text: str) -> None:
    for value in (
        of(text, lambda fields: forms.number(fields, "N", least=1)),
        of(text, lambda fields: forms.seconds(fields, "N")),
    ):
        if isinstance(value, BenchbotError):
            assert value.title.startswith("N is not")
            assert text.strip()
        else:
            assert (value is None) == (not text.strip())
            assert value is None or 0 < value < float("inf")


def of(text: str, read: Callable[[dict[str, str]], float | None]) -> float | BenchbotError | None:
    try:
        return read({"N": text})
    except BenchbotError as error:
        return error
