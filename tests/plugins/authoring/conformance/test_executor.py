"""The executor in the box conforms; each variant of it that breaks one promise is found out."""

import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from benchbot.core.light_records import Executor
from benchbot.core.records import Workers, WorkOrder
from benchbot.plugins.local_executor import workers
from benchbot.testing import check_executor
from tests.plugins.authoring.conformance.reading import all_is_well, broken


def test_the_executor_in_the_box_conforms() -> None:
    assert all_is_well(check_executor("local"))


class Altered:
    """Workers of this machine, with something else about them."""

    def __init__(self, real: Workers, **changes: Any) -> None:
        self._real = real
        self._changes = changes

    def __getattr__(self, name: str) -> Any:
        return self._changes.get(name, getattr(self._real, name))


def launching(change: Callable[[WorkOrder], WorkOrder], **changes: Any) -> Callable[[WorkOrder], Any]:
    return lambda order: Altered(workers.launch(change(order)), **changes)


def without_options(order: WorkOrder) -> Any:
    return workers.launch(replace(order, options={}))


def one_fewer(order: WorkOrder) -> WorkOrder:
    return replace(order, count=max(1, order.count - 1))


def in_an_empty_environment(order: WorkOrder) -> WorkOrder:
    return replace(order, command=("/usr/bin/env", "-i", *order.command))


def with_a_name_of_my_own(order: WorkOrder) -> WorkOrder:
    code = "import os, sys; os.execv(sys.argv[1], [*sys.argv[1:-1], sys.argv[-1] + ' (mine)'])"
    return replace(order, command=(sys.executable, "-c", code, *order.command))


def killing(order: WorkOrder) -> Any:
    real = workers.launch(order)

    def stop() -> None:
        real._signal(signal.SIGKILL)
        real.stop()

    return Altered(real, stop=stop)


def lost(reference: str) -> Workers:
    return workers.attach("[]")


@pytest.mark.parametrize(
    ("changes", "subject", "words"),
    [
        ({"launch": launching(one_fewer)}, "launch", "did not start"),
        ({"launch": launching(lambda order: order, alive=lambda: 7)}, "launch", "alive() is 7"),
        ({"launch": launching(lambda order: order, reference=None)}, "launch", "reference is None"),
        ({"launch": launching(with_a_name_of_my_own)}, "names", "(mine)"),
        ({"launch": launching(in_an_empty_environment)}, "environment", "variable of the driver"),
        ({"launch": launching(lambda order: order, alive=lambda: 2)}, "workers that end", "no zombies"),
        ({"attach": lost}, "attach", "finds 0 of two"),
        ({"launch": killing}, "stop", "without a SIGTERM first"),
        (
            {"attach": lambda reference: Altered(lost(reference), alive=lambda: 1)},
            "a reference to nothing left",
            "counts",
        ),
        ({"launch": without_options}, "unknown options", "no_such_option"),
    ],
)
def test_a_broken_promise_is_found_out(changes: dict[str, Any], subject: str, words: str) -> None:
    executor = Executor("mine", workers.launch, workers.attach)._replace(**changes)
    assert words in broken(check_executor(executor, patience_s=3.0, only=[subject]))[subject]


def test_what_cannot_be_started_is_told() -> None:
    def launch(order: WorkOrder) -> Workers:
        raise subprocess.SubprocessError("no cluster")

    assert "no cluster" in broken(check_executor(Executor("mine", launch, workers.attach)))["launch"]
