"""What is asked of Slurm is never less than what was ordered."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.core.errors import BenchbotError
from benchbot.core.records import Resources, WorkOrder
from benchbot_executor_slurm import options


def flags(resources: Resources, **chosen: str) -> dict[str, str]:
    order = WorkOrder(Path(), (), 1, resources, chosen)
    return dict(flag.removeprefix("--").split("=", 1) for flag in options.flags(order))


@given(memory=st.integers(1, 2**45), time_s=st.floats(0, 1e7), cpus=st.integers(1, 512), gpus=st.integers(0, 16))
def test_amounts_are_rounded_up_to_slurms_units(memory: int, time_s: float, cpus: int, gpus: int) -> None:
    asked = flags(Resources(cpus, gpus, memory, time_s))
    assert memory <= int(asked["mem"].removesuffix("M")) * 2**20 < memory + 2**20
    assert max(time_s, 60 * options.SHORTEST_MIN) <= int(asked["time"]) * 60 < max(time_s + 60, 60 * 4)
    assert asked["cpus-per-task"] == str(cpus)
    assert asked.get("gres") == (f"gpu:{gpus}" if gpus else None)


def test_what_is_not_ordered_is_left_to_the_cluster() -> None:
    assert flags(Resources()) == {"cpus-per-task": "1"}


def test_a_persons_own_choice_of_gpus_is_taken() -> None:
    assert flags(Resources(gpus=1), gres="shard:4", account="lab")["gres"] == "shard:4"


def test_an_option_that_is_none_is_refused_with_those_that_are() -> None:
    with pytest.raises(BenchbotError, match="no option array") as caught:
        options.check(WorkOrder(Path(), (), 1, options={"array": "0-99"}))
    assert "partition" in caught.value.why
