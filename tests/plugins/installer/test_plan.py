from pathlib import Path

import pytest

from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.distributions import Distribution
from benchbot.plugins.installer.plan import Action, action_of, unpacked


@pytest.mark.parametrize(
    ("old", "new", "action"),
    [
        (None, "1.0", Action.ADD),
        ("1.0", None, Action.REMOVE),
        ("1.0", "1.0", Action.REPLACE),
        ("1.9", "1.10", Action.UPGRADE),
        ("1.0rc1", "1.0", Action.UPGRADE),
        ("1.0", "1.0.1", Action.UPGRADE),
        ("1.0", "1.0.post1", Action.UPGRADE),
        ("2.0", "2.0.dev1", Action.DOWNGRADE),
        ("2.0", "1.9", Action.DOWNGRADE),
    ],
)
def test_what_leads_from_one_version_to_another(old: str | None, new: str | None, action: Action) -> None:
    assert action_of(old, new) is action


def test_a_wheel_that_brings_more_or_less_than_it_says_is_damaged(tmp_path: Path) -> None:
    info = tmp_path / "acme-1.0.dist-info"
    info.mkdir()
    (info / "RECORD").write_text("acme/__init__.py,,\nacme-1.0.dist-info/RECORD,,\n")
    (tmp_path / "acme").mkdir()
    (tmp_path / "acme" / "__init__.py").write_text("")
    assert unpacked(["acme"], tmp_path) == {"acme": Distribution("acme", "1.0", info)}

    (tmp_path / "acme" / "hidden.py").write_text("")
    with pytest.raises(BenchbotError, match="A wheel is damaged") as caught:
        unpacked(["acme"], tmp_path)
    assert caught.value.why == "It holds files that its RECORD does not name: acme/hidden.py."
    with pytest.raises(BenchbotError, match="A wheel is damaged"):
        unpacked(["other"], tmp_path)
