"""What may be trained on."""

from pathlib import Path

import pytest

from benchbot.plugin import BenchbotError
from benchbot_baselines.collecting import Settings, begin, place_file
from benchbot_baselines.seeds import seeds_of, split_of


def collection(folder: Path, *seeds: int) -> Path:
    begin(folder, Settings())
    for seed in seeds:
        place_file(folder, seed).touch()
    return folder


def test_seeds_that_twenty_divides_are_held_out(tmp_path: Path) -> None:
    assert seeds_of(collection(tmp_path, 1001, 1000, 1019, 1020)) == ([1001, 1019], [1000, 1020])


def test_places_that_solutions_may_be_scored_in_are_for_tests() -> None:
    assert [split_of(seed) for seed in (980, 999, 1000, 1001)] == ["test", "test", "validation", "train"]


@pytest.mark.parametrize("seed", [1, 5, 999])
def test_seeds_that_shipped_environments_may_have_are_refused(tmp_path: Path, seed: int) -> None:
    with pytest.raises(BenchbotError, match="not to be trained on"):
        seeds_of(collection(tmp_path, 1000, 1001, seed))


def test_a_place_without_a_seed_is_refused(tmp_path: Path) -> None:
    (collection(tmp_path, 1000, 1001) / "places" / "house_1.npz").touch()

    with pytest.raises(BenchbotError, match="house_1"):
        seeds_of(tmp_path)


def test_a_folder_that_was_not_collected_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="not made by benchbot collect"):
        seeds_of(tmp_path)


def test_places_to_train_on_and_held_out_are_both_needed(tmp_path: Path) -> None:
    with pytest.raises(BenchbotError, match="too few places"):
        seeds_of(collection(tmp_path, 1001, 1002))
