"""Helpers that read findings."""

from collections.abc import Iterable

from benchbot.core.findings import Finding, Level
from benchbot.testing import as_text


def broken(findings: Iterable[Finding]) -> dict[str, str]:
    """Return what is broken, by subject: what was seen, and the fix."""
    return {one.subject: f"{one.detail} {one.fix}" for one in findings if one.level is Level.BROKEN}


def warned(findings: Iterable[Finding]) -> dict[str, str]:
    """Return what is warned of, by subject: what was seen, and the fix."""
    return {one.subject: f"{one.detail} {one.fix}" for one in findings if one.level is Level.WARNING}


def all_is_well(findings: Iterable[Finding]) -> bool:
    """Say whether nothing is broken or warned of; show the report where that is not so."""
    looked_at = list(findings)
    bad = [one for one in looked_at if one.level is not Level.OK]
    assert not bad, as_text(looked_at)
    return bool(looked_at)
