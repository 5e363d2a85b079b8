"""The pytest plug-in behind the entry point `benchbot`: the fixture `conforms`, and reports without a traceback."""

from collections.abc import Callable, Generator, Iterable
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from benchbot.core.findings import Finding

_SECTION = "by benchbot.testing"


@pytest.fixture
def conforms(request: pytest.FixtureRequest) -> "Callable[[Iterable[Finding]], None]":
    """Assert that no finding is broken; `pytest -rP` shows what was checked.

    `def test_it(conforms): conforms(check_evaluator(…))`
    """
    from benchbot.plugins.authoring.conformance.properties import as_text, conform

    def check(findings: "Iterable[Finding]") -> None:
        looked_at = list(findings)
        request.node.add_report_section("call", _SECTION, as_text(looked_at))
        conform(looked_at)

    return check


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    call: "pytest.CallInfo[None]",
) -> "Generator[None, pytest.TestReport, pytest.TestReport]":
    """Show a nonconformity as its report alone: a traceback through the kit says nothing."""
    report = yield
    # By name: a run that checks nothing must not import the kit.
    if call.excinfo is not None and call.excinfo.type.__module__ == "benchbot.plugins.authoring.conformance.properties":
        report.longrepr = str(call.excinfo.value)
        report.sections = [section for section in report.sections if _SECTION not in section[0]]
    return report
