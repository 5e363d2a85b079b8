from pathlib import Path

import pytest

from benchbot.core.diagnosis import admit, diagnose
from benchbot.core.errors import BenchbotError, FailureClass
from benchbot.core.findings import Finding, Level
from benchbot.core.platform import PlatformSpec
from benchbot.core.records import RobotDriver

WELL = Finding(Level.OK, "graph", "3 other nodes")
WORTH_A_LOOK = Finding(Level.WARNING, "e-stop", "none is declared", "Declare one.")
DEPTH = Finding(Level.BROKEN, "depth /depth", "half of it is beyond 1800 m", "Correct the encoding.")
LASER = Finding(Level.BROKEN, "frame lidar", "it looks backwards", "Correct its yaw.")
SPEC = PlatformSpec({"name": "cart"}, "ground_truth", Path("unused"))


def test_a_robot_that_is_well_or_worth_a_look_is_admitted() -> None:
    admit("cart", [WELL, WORTH_A_LOOK], [])


def test_what_is_broken_refuses_the_robot_with_every_reason_fix_and_way_round() -> None:
    with pytest.raises(BenchbotError, match="'cart' is not fit to be driven") as caught:
        admit("cart", [WELL, DEPTH, LASER], [])

    assert caught.value.why.splitlines()[1:] == [
        "depth /depth: half of it is beyond 1800 m",
        "frame lidar: it looks backwards",
    ]
    assert caught.value.fix.splitlines() == [
        "Correct the encoding.",
        "Correct its yaw.",
        "To drive it all the same: --despite 'depth /depth' --despite 'frame lidar'",
    ]
    assert caught.value.failure is FailureClass.PLATFORM
    assert caught.value.ends_run


def test_a_finding_that_is_overridden_refuses_nothing_and_the_others_still_do() -> None:
    admit("cart", [DEPTH, LASER], ["depth /depth", "frame lidar"])
    with pytest.raises(BenchbotError, match="not fit") as caught:
        admit("cart", [DEPTH, LASER], ["depth /depth"])
    assert "depth" not in caught.value.why


def test_a_finding_may_be_overridden_that_has_been_mended_meanwhile() -> None:
    admit("cart", [WELL], ["graph"])


def test_a_name_that_is_no_finding_is_refused_with_the_nearest() -> None:
    with pytest.raises(BenchbotError, match="no finding 'depth /dept'") as caught:
        admit("cart", [WELL, DEPTH], ["depth /dept"])
    assert "Did you mean 'depth /depth'?" in caught.value.why


def test_a_driver_without_a_diagnosis_finds_nothing() -> None:
    assert list(diagnose(RobotDriver("seen", lambda spec: None), "acme", SPEC)) == []  # type: ignore[arg-type,return-value]


def test_a_diagnosis_that_fails_is_a_finding_after_those_before() -> None:
    def fails(_spec: PlatformSpec):  # type: ignore[no-untyped-def]
        yield WELL
        raise OSError("no route")

    found = list(diagnose(RobotDriver("seen", lambda spec: None, fails), "acme", SPEC))  # type: ignore[arg-type,return-value]

    assert found[0] == WELL
    assert (found[1].level, found[1].subject) == (Level.BROKEN, "robot cart")
    assert "OSError: no route" in found[1].detail
    assert "acme" in found[1].fix
