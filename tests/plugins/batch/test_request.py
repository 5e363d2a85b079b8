from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.core.request import Limits
from benchbot.plugins.batch.request import merged, names, numbers, request_of, settings_axes, split_values


@pytest.mark.parametrize(
    ("text", "found"),
    [("3", [3]), ("0..4", [0, 1, 2, 3, 4]), ("0,2,7..9", [0, 2, 7, 8, 9]), ("4..4", [4]), ("1, 1..2", [1, 2])],
)
def test_numbers_are_listed_or_ranges_with_both_ends(text: str, found: list[int]) -> None:
    assert numbers("--seeds", text) == found


@pytest.mark.parametrize("text", ["", "a", "3..1", "1.5", "-1", "0..", "0..99999999999"])
def test_what_is_no_number_is_said(text: str) -> None:
    with pytest.raises(BenchbotError, match="names no numbers"):
        numbers("--seeds", text)


def test_names_are_taken_once() -> None:
    assert names("a, b,,a") == ["a", "b"]


def test_several_values_of_a_setting_are_an_axis() -> None:
    assert settings_axes(["options.samples=8,12,22", "lighting.on=[lamp_1, lamp_2]", "assets=x"]) == {
        "options.samples": [8, 12, 22],
        "lighting.on": [["lamp_1", "lamp_2"]],
        "assets": ["x"],
    }


def test_a_setting_is_named_once() -> None:
    with pytest.raises(BenchbotError, match=r"--set lighting\.time is given twice"):
        settings_axes(["lighting.time=8", "lighting.time=9"])


def test_a_batch_reads_its_secret_and_draws_none(tmp_path: Path) -> None:
    wanted = {"task": "t", "robots": "r", "environments": "a:1"}
    (tmp_path / "secret.txt").write_text(16 * "0F" + "\n")
    assert request_of({**wanted, "secret": str(tmp_path / "secret.txt")}).secret == 16 * "0f"
    assert request_of(wanted).secret == ""
    with pytest.raises(BenchbotError, match="A batch cannot draw its secret") as caught:
        request_of({**wanted, "secret": "random"})
    assert "token_hex" in caught.value.fix


VALUES = st.sampled_from(["8", "21:30", "[a, b]", "{x: 1, y: [2, 3]}", "'a,b'", "all"])


@given(st.lists(VALUES, min_size=1, max_size=5))
def test_values_are_split_where_they_were_joined(values: list[str]) -> None:
    assert split_values(",".join(values)) == values


TOLD: dict[str, Any] = {
    "name": "night",
    "task": "t",
    "robots": ["r"],
    "environments": ["a:1"],
    "example": "e",
    "seeds": "0..1",
    "limits": {"steps": 5},
    "set": {"lighting.time": [8, 22], "assets": "x"},
    "retries": 7,
}


def test_a_file_says_what_options_would() -> None:
    request = request_of(TOLD)
    assert (request.task, request.robots, request.environments, request.seeds) == ("t", ["r"], ["a:1"], [0, 1])
    assert request.settings == {"lighting.time": ["08:00", "22:00"], "assets": ["x"]}
    assert request.limits == Limits(steps=5)
    assert request.policy.retries == 7


def test_options_override_a_file() -> None:
    given = {"native": "python x.py", "seeds": "4", "limits": {"steps": None, "wall_time_s": 9.0}, "task": None}
    request = request_of(merged(TOLD, given))
    assert (request.native, request.example, request.seeds) == ("python x.py", None, [4])
    assert request.limits == Limits(steps=5, wall_time_s=9.0)
    assert request.task == "t"


def test_everything_that_is_missing_is_named_at_once() -> None:
    with pytest.raises(BenchbotError) as caught:
        request_of({"example": "hello_passive"})
    assert caught.value.why == "Missing: --task, --robots, --envs or --envs-batch."
