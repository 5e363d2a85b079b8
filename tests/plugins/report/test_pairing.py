import random

from benchbot.plugins.report.pairing import Row, label, pair


def row(environment: str | None, seed: int | None = None, source: str = "a.json", **keys: int | None) -> Row:
    return {"environment": environment, "seed": seed, "source": source, "scores": {}, **keys}


def test_rows_pair_by_environment_and_seed() -> None:
    found = pair(
        [row("flat:1", 0), row("flat:1", 1), row("flat:2", 0)], [row("flat:1", 1), row("flat:1", 2), row("flat:2", 0)]
    )

    assert [item.label for item in found.pairs] == ["flat:1, seed 1", "flat:2, seed 0"]
    assert [label(item) for item in found.only_a] == ["flat:1, seed 0"]
    assert [label(item) for item in found.only_b] == ["flat:1, seed 2"]


def test_episodes_and_repeats_are_told_apart() -> None:
    episodes = [row("flat:1", 0, episode=number) for number in range(3)]
    repeats = [row("flat:2", 0, repeat=number) for number in range(2)]

    found = pair([*episodes, *repeats], [*episodes[1:], *repeats[:1]])

    assert [item.label for item in found.pairs] == [
        "flat:1, seed 0, episode 1",
        "flat:1, seed 0, episode 2",
        "flat:2, seed 0, repeat 0",
    ]
    assert len(found.only_a) == 2


def test_a_row_that_does_not_say_its_seed_pairs_with_what_is_left() -> None:
    found = pair([row("flat:1"), row("flat:1", 0)], [row("flat:1", 0), row("flat:1", 7), row("flat:1", 8)])

    assert [(item.a["seed"], item.b["seed"]) for item in found.pairs] == [(0, 0), (None, 7)]
    assert [item["seed"] for item in found.only_b] == [8]


def test_seeds_can_be_ignored() -> None:
    rows_a, rows_b = [row("flat:1", 4), row("flat:1", 3)], [row("flat:1", 9), row("flat:1", 8)]

    assert pair(rows_a, rows_b).pairs == []
    found = pair(rows_a, rows_b, ignore_seeds=True)
    assert [(item.a["seed"], item.b["seed"]) for item in found.pairs] == [(3, 8), (4, 9)]


def test_where_seeds_are_ignored_rows_pair_in_their_order_and_those_without_come_last() -> None:
    rows_a = [row("flat:1", None, "1.json"), row("flat:1", 1, "2.json"), row("flat:1", 0, "3.json")]
    rows_b = [row("flat:1", seed) for seed in (5, 6, 7)]

    found = pair(rows_a, rows_b, ignore_seeds=True)

    assert [(item.a["seed"], item.b["seed"]) for item in found.pairs] == [(0, 5), (1, 6), (None, 7)]


def test_what_is_of_no_known_environment_has_no_counterpart() -> None:
    found = pair([row(None, source="torn.json")], [row(None)], ignore_seeds=True)

    assert found.pairs == []
    assert label(found.only_a[0]) == "torn.json"


def test_the_order_of_rows_does_not_matter() -> None:
    rows_a = [row(f"flat:{variant}", seed, f"{seed}.json") for variant in range(4) for seed in (0, 1, None)]
    rows_b = [row(f"flat:{variant}", seed, f"{seed}.json") for variant in range(1, 5) for seed in (1, 2, 3)]
    straight = pair(rows_a, rows_b)
    random.Random(0).shuffle(rows_a)
    random.Random(1).shuffle(rows_b)

    assert pair(rows_a, rows_b) == straight


DAY, NIGHT = {"lighting.time": "12:00"}, {"lighting.time": "21:30"}


def test_settings_are_conditions_that_do_not_pair_with_others() -> None:
    rows_a = [{**row("flat:1", 0), "settings": DAY}, {**row("flat:1", 0), "settings": NIGHT}, row("flat:1", 0)]
    rows_b = [{**row("flat:1", 0), "settings": NIGHT}, row("flat:1")]

    found = pair(rows_a, rows_b)

    assert [item.label for item in found.pairs] == ["flat:1, seed 0", "flat:1, seed 0, lighting.time=21:30"]
    assert [label(item) for item in found.only_a] == ["flat:1, seed 0, lighting.time=12:00"]


def test_settings_can_be_ignored_to_ask_what_they_change() -> None:
    day = [{**row("flat:1", seed), "settings": DAY} for seed in range(2)]
    night = [{**row("flat:1", seed), "settings": NIGHT} for seed in range(2)]

    assert pair(day, night).pairs == []
    found = pair(day, night[::-1], ignore_settings=True)

    assert [(item.label, item.a["settings"], item.b["settings"]) for item in found.pairs] == [
        ("flat:1, seed 0", DAY, NIGHT),
        ("flat:1, seed 1", DAY, NIGHT),
    ]
    assert [item.label for item in pair(night, day, ignore_settings=True).pairs] == ["flat:1, seed 0", "flat:1, seed 1"]


def test_of_a_fleet_each_robot_pairs_with_itself_and_where_there_is_none_with_another() -> None:
    def of(robot: str, source: str) -> Row:
        return row("room:1", seed=0, source=source) | {"provenance": {"selection": {"robot": robot}}}

    before = [of("cart@r1", "1.json"), of("cart@r2", "2.json"), of("cart@r3", "3.json")]
    after = [of("cart@r2", "1.json"), of("cart@r1", "2.json"), of("cart@r4", "3.json")]
    paired = pair(before, after)
    robots = [[side["provenance"]["selection"]["robot"] for side in (item.a, item.b)] for item in paired.pairs]
    assert robots == [["cart@r1", "cart@r1"], ["cart@r2", "cart@r2"], ["cart@r3", "cart@r4"]]
    assert (paired.only_a, paired.only_b) == ([], [])
