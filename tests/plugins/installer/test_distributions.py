"""What distributions need, as their metadata says."""

from pathlib import Path

import pytest

from benchbot.plugins.installer.distributions import found_in, unused_without, with_dependencies


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


def test_what_nothing_else_needs_and_nobody_has_asked_for_is_unused(site: Path) -> None:
    def unused(*leaving: str) -> list[str]:
        return [one.name for one in unused_without(leaving, found_in([site]))]

    assert unused("screens") == ["links", "mark-up", "numbers"]
    assert unused("links") == []
    (site / "mark_up-1.0.dist-info" / "REQUESTED").touch()
    # It goes on needing numbers; nothing but screens has asked for its links.
    assert unused("screens") == ["links"]
    (site / "links-1.0.dist-info" / "entry_points.txt").write_text("[benchbot]\nlinks = links\n")
    assert unused("screens") == []
