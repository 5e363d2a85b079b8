"""`benchbot certify` says at once what it cannot certify."""

import pytest

from tests.command_line import Here


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sim_sampel"], "Did you mean 'sim_sample'?"),
        (["sim_sample", "--reference", "sim_none"], "There is no simulator 'sim_none' to compare with."),
        (
            ["sim_sample", "--reference", "sim_sample", "--robot", "sample_real_robot"],
            "The robot 'sample_real_robot' does not run in sim_sample.",
        ),
        (["benchbot-sample", "--reference", "sim_sample"], "semantic_slam:passive:ground_truth:segmentation"),
    ],
)
def test_what_cannot_be_certified_is_told_before_anything_runs(here: Here, words: list[str], said: str) -> None:
    done = here("certify", *words)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Certifying" not in done.stderr
