"""Objects won and lost between two results."""

from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.drawing.map_model import FALSE_NEGATIVE, IGNORED, MATCH
from benchbot.plugins.report.object_changes import changes

VERDICTS = st.dictionaries(st.integers(0, 9), st.sampled_from([MATCH, FALSE_NEGATIVE, IGNORED, None]))


@given(VERDICTS, VERDICTS)
def test_what_one_has_won_the_other_has_lost(mine: dict[int, str | None], theirs: dict[int, str | None]) -> None:
    found, turned = changes(mine, theirs), changes(theirs, mine)

    assert (set(found.won), set(found.lost)) == (set(turned.lost), set(turned.won))
    assert (found.both, found.neither) == (turned.both, turned.neither)
    judged = [each for each in mine if {mine[each], theirs.get(each)} <= {MATCH, FALSE_NEGATIVE}]
    assert len(found.won) + len(found.lost) + found.both + found.neither == len(judged)


def test_what_is_ignored_is_neither_won_nor_lost() -> None:
    found = changes({1: MATCH, 2: MATCH, 3: FALSE_NEGATIVE}, {1: IGNORED, 2: FALSE_NEGATIVE, 3: MATCH})

    assert (found.won, found.lost) == ([2], [3])
