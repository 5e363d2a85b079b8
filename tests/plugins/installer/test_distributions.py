"""What distributions need, as their metadata says."""

from pathlib import Path

import pytest

from benchbot.plugins.installer.distributions import found_in, with_dependencies


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """`screens` needs an extra of `markup`, which is the only one to need `links`; nobody asks for `plugins`."""
    needs = {
        "screens": ["Mark.Up[Links] (>=2.1,<5); python_version >= '3.9'", "numbers>=2"],
        "mark_up": ["numbers", "links<3,>=1; extra == 'links'", 'plugins; extra == "all"', "absent"],
        "numbers": ["screens ; extra == 'circle'"],
        "links": [],
        "plugins": [],
    }
    for name, texts in needs.items():
        info = tmp_path / f"{name}-1.0.dist-info"
        info.mkdir()
        lines = [
            "Metadata-Version: 2.1",
            f"Name: {name}",
            "Version: 1.0",
            *(f"Requires-Dist: {each}" for each in texts),
        ]
        (info / "METADATA").write_text("\n".join(lines) + "\n")
    return tmp_path


def test_extras_are_needed_where_they_are_asked_for(site: Path) -> None:
    available = found_in([site])

    assert available["screens"].requires() == {"mark-up": frozenset({"links"}), "numbers": frozenset()}
    assert available["mark-up"].requires() == {"numbers": frozenset(), "absent": frozenset()}
    assert sorted(with_dependencies(["Screens"], available)) == ["links", "mark-up", "numbers", "screens"]
    assert sorted(with_dependencies(["mark_up"], available)) == ["mark-up", "numbers"]


def test_an_extra_that_is_asked_for_later_counts(site: Path) -> None:
    found = with_dependencies(["screens", "mark-up"], found_in([site]))

    assert "links" in found
