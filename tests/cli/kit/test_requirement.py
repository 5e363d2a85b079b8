import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.cli.kit import requirement
from benchbot.cli.kit.requirement import Requirement
from benchbot.core.errors import BenchbotError, ExitCode


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("OMQ>=0.4", Requirement("OMQ", ">=", 0.4)),
        (" avg_label < 1e-3 ", Requirement("avg_label", "<", 0.001)),
        ("x>.5", Requirement("x", ">", 0.5)),
        ("x<=-1.", Requirement("x", "<=", -1.0)),
    ],
)
def test_requirements_are_read(text: str, expected: Requirement) -> None:
    assert requirement.parse([text]) == [expected]


@pytest.mark.parametrize("text", ["", "OMQ", "OMQ=0.4", "OMQ>=", ">=0.4", "OMQ>=much", "OMQ>=nan", "OMQ>=0.4 and more"])
def test_what_is_no_requirement_is_refused_with_an_example(text: str) -> None:
    with pytest.raises(BenchbotError, match="is not a requirement") as caught:
        requirement.parse([text])
    assert "OMQ>=0.4" in caught.value.fix


# No subnormal numbers: some libraries that other tests load make the processor round them to zero, for good.
@given(st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False), st.sampled_from([">=", ">", "<=", "<"]))
def test_a_requirement_survives_being_written_and_read(threshold: float, sign: str) -> None:
    assert requirement.parse([f"OMQ{sign}{threshold!r}"]) == [Requirement("OMQ", sign, threshold)]


def test_all_missed_requirements_are_named_and_the_exit_code_says_so() -> None:
    wanted = requirement.parse(["OMQ>=0.4", "avg_label>0.9", "avg_spatial>0"])

    with pytest.raises(BenchbotError) as caught:
        requirement.check(wanted, {"OMQ": 0.39999, "avg_label": 0.9, "avg_spatial": 0.5})

    assert caught.value.exit_code == ExitCode.BELOW_THRESHOLD
    assert caught.value.why.splitlines() == [
        "OMQ >= 0.4 is required; the score is 0.39999.",
        "avg_label > 0.9 is required; the score is 0.9.",
    ]


def test_a_score_that_does_not_exist_is_a_usage_error() -> None:
    with pytest.raises(BenchbotError, match="There is no score 'OMG'") as caught:
        requirement.check(requirement.parse(["OMG>=0.4"]), {"OMQ": 1.0})
    assert caught.value.exit_code == ExitCode.USAGE
    assert "Did you mean 'OMQ'?" in caught.value.why
