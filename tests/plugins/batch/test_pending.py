from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchbot.plugins.batch.pending import Pending
from benchbot.plugins.batch.plan import PlannedEpisode


def episodes(*counts: int) -> list[PlannedEpisode]:
    """Return as many episodes in each environment as it says."""
    return [
        PlannedEpisode(f"{place}.{seed}", "", "robot", f"arena:{place}", seed)
        for place, count in enumerate(counts)
        for seed in range(count)
    ]


def keys(found: Iterator[PlannedEpisode]) -> list[str]:
    return [episode.key for episode in found]


class Key(str):
    """The key of an episode, which counts how often any of them is looked up."""

    lookups = 0

    def __hash__(self) -> int:
        Key.lookups += 1
        return super().__hash__()


def test_the_loaded_scene_is_first_then_those_without_workers_and_then_those_with_few() -> None:
    planned = episodes(3, 1, 2, 2, 4)
    pending = Pending(planned, "me")
    claimed = {"2.0", "3.0", "3.1", "4.0", "4.1"}
    found = keys(pending.candidates(claimed, planned[3].scene))
    assert found == ["1.0", "0.0", "0.1", "0.2", "2.1", "4.2", "4.3"]
    assert keys(pending.candidates(claimed, None)) == ["0.0", "0.1", "0.2", "1.0", "2.1", "4.2", "4.3"]


def test_workers_that_begin_together_spread_over_scenes() -> None:
    planned = episodes(*[2] * 50)
    first = {next(Pending(planned, f"worker-{number}").candidates(set(), None)).scene for number in range(20)}
    assert len(first) > 10


@given(st.lists(st.integers(0, 5), max_size=8), st.data())
def test_every_episode_without_a_claim_is_offered_once_also_when_others_are_dropped_meanwhile(
    counts: list[int], data: st.DataObject
) -> None:
    planned = episodes(*counts)
    everything = {episode.key for episode in planned}
    claimed = data.draw(st.sets(st.sampled_from(sorted(everything)))) if everything else set()
    loaded = data.draw(st.sampled_from([None, *(episode.scene for episode in planned)]))
    pending, offered = Pending(planned, "me"), []
    for episode in pending.candidates(claimed, loaded):
        offered.append(episode.key)
        if data.draw(st.booleans()):
            pending.drop(episode)
            pending.drop(episode)
    assert sorted(offered) == sorted(everything - claimed)
    assert {episode.key for episode in pending.of(claimed)} == claimed


@pytest.mark.parametrize("counts", [[2000], [1] * 2000, [40] * 50])
def test_all_choices_together_look_at_each_episode_a_few_times(counts: list[int]) -> None:
    planned = [replace(episode, key=Key(episode.key)) for episode in episodes(*counts)]
    claimed = {planned[0].key}
    pending, loaded, chosen = Pending(planned, "me"), None, 0
    Key.lookups = 0
    while (episode := next(pending.candidates(claimed, loaded), None)) is not None:
        loaded, chosen = episode.scene, chosen + 1
        pending.drop(episode)
    assert chosen == len(planned) - 1
    assert Key.lookups < 20 * len(planned)
