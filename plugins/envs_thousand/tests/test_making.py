"""The thousand places: frozen, split, and each made when it is first used, with no other command than any place."""

import json
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import yaml

from benchbot.cli.kit import making as kit_making
from benchbot.cli.kit.preflight import scenes_of
from benchbot.core import plugin_manager
from benchbot.core.declarations import schema
from benchbot.core.declarations.catalog import Catalog
from benchbot.core.errors import BenchbotError
from benchbot.plugins.sandbox.view import hidden_paths
from benchbot_envs_thousand import making, plugin
from benchbot_envs_thousand.making import SPLITS, digest, is_made, lamps_by_day, lighting, make, places, write
from benchbot_scenes.compose import compose
from benchbot_scenes.gltf import load_scene
from tests.command_line import CommandLine
from tools.thousand.__main__ import freeze

EACH = [3, 18, 905]
"""A small place of a day, one of five rooms, one to test in."""
SUMMED = 650
"""A place with a row of pictures whose width `sum` rounds otherwise in Python 3.12 than in 3.11."""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("BENCHBOT_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache" / "places" / "thousand"


def test_a_thousand_places_are_frozen() -> None:
    found = places()
    assert list(found) == list(range(1, 1001))
    assert len({place.seed for place in found.values()}) == len({place.sha256 for place in found.values()}) == 1000


@pytest.mark.parametrize("split", SPLITS)
def test_every_split_has_all_kinds_and_sizes_alike(split: str) -> None:
    among = [places()[number] for number in SPLITS[split]]
    for counted in (Counter(place.kind for place in among), Counter(place.rooms for place in among)):
        assert max(counted.values()) - min(counted.values()) <= 4
    assert len({(place.kind, place.rooms) for place in among}) == 32


def test_the_splits_are_batches() -> None:
    (folder,) = plugin.benchbot_batches()
    named = {path.stem: schema.read(path) for path in folder.iterdir()}
    assert {name: batch["name"] for name, batch in named.items()} == {name: f"thousand_{name}" for name in SPLITS}
    for name, among in SPLITS.items():
        assert named[name]["environments"] == [f"thousand_{number}:1" for number in among]


@pytest.mark.parametrize("number", [*EACH, SUMMED])
def test_a_place_is_the_same_everywhere(number: int, cache: Path) -> None:
    folder = make(number)
    assert folder == cache / str(number)
    assert digest(folder, number) == places()[number].sha256
    declared = folder / "environments" / f"thousand_{number}_1.yaml"
    schema.check(schema.read(declared), "environment", declared)
    assert [path.name for path in cache.iterdir()] == [str(number)]


def test_places_that_are_made_by_several_processes_at_once_are_the_same(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kit_making, "processors", lambda: 2)
    assert [is_made(number) for number in EACH] == [False] * 3
    found = scenes_of(Catalog(plugin_manager.load()), [f"thousand_{number}:1" for number in EACH])

    assert [scene.name for scene in found] == [f"thousand_{number}:1" for number in EACH]
    assert {path.name: digest(path, int(path.name)) for path in cache.iterdir()} == {
        str(number): places()[number].sha256 for number in EACH
    }
    assert [is_made(number) for number in EACH] == [True] * 3


def test_the_scene_that_a_place_comes_with_is_that_of_its_layout(tmp_path: Path) -> None:
    made, _ = write(places()[904], tmp_path)  # of which a cup was taken away, since nothing shows it
    (tmp_path / "scene.glb").write_bytes(compose(made.layout))
    composed = load_scene(tmp_path / "scene.glb")
    assert made.scene is not None
    assert [instance.name for instance in made.scene.instances] == [instance.name for instance in composed.instances]
    np.testing.assert_array_equal(
        made.scene.vertices[made.scene.triangles], composed.vertices[composed.triangles], strict=True
    )


def test_a_place_is_made_once_and_again_when_it_is_damaged(cache: Path) -> None:
    declared = make(3) / "environments" / "thousand_3_1.yaml"
    made = declared.stat().st_mtime_ns
    make(3)
    assert declared.stat().st_mtime_ns == made

    declared.write_text(declared.read_text().replace("thousand", "million"))
    make(3)
    assert schema.read(declared)["name"] == "thousand_3"


@pytest.mark.parametrize("is_damaged", [False, True])
def test_who_makes_the_same_place_at_once_gets_the_same(is_damaged: bool, cache: Path) -> None:
    if is_damaged:
        (cache / "3" / "environments").mkdir(parents=True)
    with ThreadPoolExecutor(5) as pool:
        assert set(pool.map(lambda number: digest(make(number), number), [3] * 5)) == {places()[3].sha256}
    assert [path.name for path in cache.iterdir()] == ["3"]


def test_a_place_that_comes_out_different_is_refused(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frozen = {**places(), 3: places()[3]._replace(seed=4)}
    monkeypatch.setattr(making, "places", lambda: frozen)
    with pytest.raises(BenchbotError, match="thousand_3:1 is not the place that it is elsewhere") as caught:
        make(3)
    assert "pip install --upgrade benchbot-envs-thousand" in caught.value.fix
    assert list(cache.iterdir()) == []


def test_a_cache_that_cannot_be_written_is_told(cache: Path) -> None:
    cache.parent.parent.mkdir()
    cache.parent.write_text("a file, where the folder should be")
    with pytest.raises(BenchbotError, match="thousand_3:1 cannot be kept in") as caught:
        make(3)
    assert "BENCHBOT_CACHE_DIR" in caught.value.fix


def test_light_is_of_days_and_evenings() -> None:
    drawn = [lighting(seed, []) for seed in range(200)]
    evenings = sum(light["lamps"]["on"] == "all" for light in drawn)
    assert 0.2 < evenings / len(drawn) < 0.4
    assert all((light["time"] >= "19:00") == (light["lamps"]["on"] == "all") for light in drawn)
    assert lighting(7, []) == lighting(7, []) != lighting(8, [])


def test_rooms_with_little_window_have_their_lamps_on_by_day(tmp_path: Path) -> None:
    made, _ = write(places()[18], tmp_path)
    declared = schema.read(tmp_path / "environments" / "thousand_18_1.yaml")["lighting"]
    assert declared["time"] < "19:00"
    assert declared["lamps"]["on"] == lamps_by_day(made)
    (washroom,) = (room for room in made.plan.spaces if room.function == "washroom")
    for item in made.items:
        if item.model.placement == "ceiling":
            is_inside = all(washroom.low[i] < item.placement.position[i] < washroom.high[i] for i in (0, 1))
            assert (item.placement.id in declared["lamps"]["on"]) == is_inside


def test_freezing_gives_what_is_frozen(tmp_path: Path) -> None:
    freeze(tmp_path, 3)
    kept = json.loads((tmp_path / "3" / "place.json").read_text())
    assert kept["place"] == list(places()[3])
    assert kept["checked"]["violations"] == []


def test_solutions_see_neither_places_nor_seeds(cache: Path, tmp_path: Path) -> None:
    hidden = hidden_paths(Catalog(plugin_manager.load()), tmp_path)
    package = Path(plugin.__file__).parent.resolve()
    for path in (package / "places.csv", make(3).resolve()):
        assert any(path.is_relative_to(other) for other in hidden)


def test_any_command_takes_a_place(cli: CommandLine) -> None:
    cli.variables["BENCHBOT_PLUGINS"] = "benchbot-envs-thousand,benchbot-scenes,benchbot-assets-household"
    listed = cli("list", "environments")
    assert "made when they are first used: thousand_1:1 to thousand_1000:1" in listed.stderr

    shown = cli("show", "environment", "thousand_3:1")
    assert shown.returncode == 0, shown.stderr
    declared = yaml.safe_load(shown.stdout)
    assert (declared["name"], declared["variant"]) == ("thousand_3", 1)

    unknown = cli("show", "environment", "thousand_1001:1")
    assert unknown.returncode == 2
    assert "thousand_1:1 to thousand_1000:1" in unknown.stderr
