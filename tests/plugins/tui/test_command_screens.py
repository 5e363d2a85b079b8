"""The screens that do what commands do: usual work, and what a person may get wrong; commands are real processes."""

import json
import os
from pathlib import Path

import pytest
from textual.pilot import Pilot

from benchbot.core.declarations.catalog import Catalog
from benchbot.plugins.batch.estimate import Durations, durations
from benchbot.plugins.batch.screen import NewBatchScreen, solution_words
from benchbot.plugins.doctor.screen import DoctorScreen
from benchbot.plugins.installer.screen import PluginsScreen
from benchbot.plugins.report.object_changes import object_changes
from benchbot.plugins.report.screen import CompareScreen, comparison_text, forest
from benchbot.plugins.screens.child_command import ChildCommand, error_in
from benchbot.plugins.screens.widgets import CheckList, Table, TextField
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.home import HomeScreen
from benchbot.plugins.tui.jobs import Alive
from benchbot.plugins.tui.settings_screen import SettingsScreen
from benchbot_scenes.screen import EnvironmentsScreen
from plugins.scenes.tests.importing import places
from tests.plugin_factory import PluginFactory
from tests.plugins.doctor.test_command import DRIVER, ROBOT
from tests.plugins.tui.playing import SIZES, play, sees, until
from tests.plugins.tui.written import write_results

SCREENS = (NewBatchScreen, CompareScreen, PluginsScreen, DoctorScreen, SettingsScreen)


def test_a_new_batch_says_its_size_what_is_impossible_and_why_and_is_checked(home: Path) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("B")
        await sees(pilot, "[ ] sample_robot", "Choose a robot, an environment, a solution.")
        screen = app.screen
        assert isinstance(screen, NewBatchScreen)
        await pilot.press("ctrl+s")
        await sees(pilot, "✗ Choose a robot")
        await pilot.press("end", "space")  # the robot that nothing can run
        await pilot.press("tab", "space", "tab", "end", "space")
        await sees(pilot, "✗ walker in arena:1", "sim_walking")
        await pilot.press("shift+tab", "shift+tab", "space", "up", "space")
        await sees(pilot, "✓ sample_robot in arena:1", "= 1 episodes", "no earlier batch of this task")
        fields = {field.children[1].name: field for field in screen.query(TextField)}
        fields["Seeds"].value = "2..0"
        await sees(pilot, "✗ --seeds 2..0 names no numbers.")
        fields["Seeds"].value = "0..2"
        await sees(pilot, "1 solution × 1 robot × 1 environment × 3 seeds = 3 episodes", "--seeds=0..2")
        await pilot.press("ctrl+t")
        await sees(pilot, "Nothing is in the way: 3 episodes, 0 of them done.")
        fields["More options"].value = "--no-such-option"
        await pilot.press("ctrl+t")
        await sees(pilot, "No such option")
        await pilot.press("escape")
        assert isinstance(app.screen, HomeScreen)

    play(BenchbotApp(look=Alive), scenario, (160, 60))
    assert not list((home / "work").iterdir()), "A check has begun something."


def test_solutions_become_options_each_with_a_name_where_there_are_several() -> None:
    assert solution_words(["hello_passive"], "") == ["--example", "hello_passive"]
    assert solution_words([], "python mine.py --rate=3") == ["--native", "python mine.py --rate=3"]
    both = solution_words(["hello_passive"], "ours=python ours.py")
    assert both == ["--solution", "hello_passive=example:hello_passive", "--solution", "ours=python ours.py"]
    with pytest.raises(Exception, match="a name each"):
        solution_words(["hello_passive"], "python ours.py")


def test_an_estimate_says_what_it_rests_on(home: Path) -> None:
    places = [("sample_robot", "arena:1"), ("sample_robot", "arena:2")]
    assert durations("sample:passive", places).total_s(dict.fromkeys(places, 1), 1) is None
    known = Durations({places[0]: 10.0}, 4)
    assert known.total_s(dict.fromkeys(places, 6), 2) == 60.0
    assert "as 4 episodes of earlier batches took; 1 of 2 places were never computed" in known.told(
        dict.fromkeys(places, 6), 2
    )


def test_sets_of_results_are_compared(home: Path) -> None:
    for name in ("ours", "base"):
        write_results(home / "work" / "results" / name)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("C")
        await sees(pilot, "[ ] base", "[ ] ours", "Choose two sets")
        await pilot.press("space", "ctrl+s")
        await sees(pilot, "✗ Choose two sets of results or more.")
        await pilot.press("down", "space")
        await sees(pilot, "$ benchbot compare base=")
        await pilot.press("ctrl+s")
        await sees(pilot, "have the same OMQ", "pair by pair", "all together")
        assert isinstance(app.screen, CompareScreen)
        app.screen._more_field.value = "--paired-by scene"
        await pilot.press("ctrl+s")
        await sees(pilot, "Mean absolute difference of OMQ: 0.0000")
        app.screen._more_field.value = "--paired-by 'scene"
        await pilot.press("ctrl+s")
        await sees(pilot, "✗ More options cannot be read.")

    play(BenchbotApp(look=Alive), scenario, (120, 40))


ROWS = [{"pair": f"room:{number}", "a": 0.5, "b": 0.4, "difference": 0.1 * number} for number in (-1, 0, 2)]


def test_a_forest_has_every_pair_at_its_place_on_one_axis() -> None:
    item = {"a": "ours", "b": "base", "rows": ROWS, "difference": 0.05, "interval": {"low": -0.1, "high": 0.2}}
    lines = forest(item, 80, lower_is_better=False).plain.splitlines()
    drawn = {line.split()[0]: line for line in lines[3:]}
    assert list(drawn) == ["room:2", "room:0", "room:-1", "all"]
    zero = drawn["room:2"].index("│")
    assert drawn["room:2"].index("●") > zero == drawn["room:0"].index("●") > drawn["room:-1"].index("●")
    assert drawn["all"].index("├") < zero < drawn["all"].index("◆") < drawn["all"].index("┤")


def test_pairs_that_differ_in_their_seed_are_told_apart_where_there_is_little_room() -> None:
    rows = [{**ROWS[2], "pair": f"house_of_many_rooms:1, seed {seed}"} for seed in (1, 2)]
    item = {"a": "ours", "b": "base", "rows": rows, "difference": 0.05, "interval": None}
    labels = {line.split("  ")[0] for line in forest(item, 40, lower_is_better=False).plain.splitlines()[3:5]}
    assert len(labels) == 2
    assert all(label.startswith("house") and "…" in label for label in labels)


def test_objects_won_and_lost_are_told_as_the_truth() -> None:
    rows = [{"episode": "arena:1, seed 0", "class": "bottle", "truth": 0, "why": "Nothing overlaps it."}]
    changes = {"a": "ours", "b": "base", "won": rows, "lost": [], "episodes": 1, "both": 2, "neither": 0}
    sets: list[dict[str, object]] = [
        {"name": name, "score": 0.5, "interval": None, "failures": {}, "scored": 1, "expected": 1} for name in "ab"
    ]
    document = {"score": "OMQ", "sets": sets, "comparisons": [], "objects": [changes], "notes": []}
    text = comparison_text(document, 80).plain
    assert "this shows the truth" in text
    assert "+ only ours found 1" in text
    assert "bottle  arena:1, seed 0: Nothing overlaps it." in text


def test_an_object_that_one_set_alone_found_is_won(home: Path, catalog: Catalog) -> None:
    folder = write_results(home / "results")
    sets = {"ours": folder / "perfect.json", "base": folder / "one"}
    (changes,) = object_changes(sets, catalog=catalog)
    assert [row["class"] for row in changes["won"]] == ["bottle"]
    assert (changes["lost"], changes["both"], changes["neither"], changes["episodes"]) == ([], 0, 0, 1)


def test_plugins_are_listed_and_what_cannot_be_is_said(home: Path) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("P")
        await sees(pilot, "✓  benchbot-sample", "$ benchbot plugins show")
        table = app.screen.query_one(Table)
        await pilot.press("i")
        await sees(pilot, "Search for one first")
        await pilot.press("end", "X")
        await sees(pilot, "is not BenchBot itself")
        app.clear_notifications()
        await pilot.press("slash")
        fields = list(app.screen.query(TextField))
        fields[1].value = "ftp://nowhere"
        fields[0].value = "robot"
        await pilot.press("enter")
        await sees(pilot, "ftp://nowhere cannot be searched.", "→")
        assert table.marked is not None

    play(BenchbotApp(look=Alive), scenario, (120, 40))


def test_a_diagnosis_has_the_worst_first_and_its_fix(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "999")

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("D")
        await sees(pilot, "well", "Python")
        screen = app.screen
        assert isinstance(screen, DoctorScreen)
        levels = [finding["level"] for finding in screen._findings]
        assert levels == sorted(levels, key=["broken", "warning", "ok"].index)
        await pilot.press("f5", "escape")
        assert isinstance(app.screen, HomeScreen)

    play(BenchbotApp(look=Alive), scenario, (120, 40))


def test_a_real_robot_is_looked_at_where_its_driver_can(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    driver = DRIVER.format(then="yield Finding(Level.BROKEN, 'e-stop', 'no answer', 'Plug it in.')")
    PluginFactory(home).make("benchbot-seeing", driver, {"robots/seen.yaml": ROBOT})
    monkeypatch.setenv("BENCHBOT_PLUGINS", f"{os.environ['BENCHBOT_PLUGINS']},benchbot-seeing")
    monkeypatch.setenv("PYTHONPATH", f"{home}{os.pathsep}{os.environ['PYTHONPATH']}")
    monkeypatch.syspath_prepend(home)

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("D")
        await sees(pilot, "well", "Python")
        screen = app.screen
        assert isinstance(screen, DoctorScreen)
        # Chosen by the mouse: the list opens, and the last one is the robot.
        await pilot.click(screen._what_field.widget)
        await sees(pilot, "the robot seen_robot, which is switched on")
        await pilot.press("end", "enter")
        await sees(pilot, "$ benchbot doctor --robot seen_robot", "✗ 1 broken", "Plug it in.", "10.0 Hz")
        table = screen.query_one(Table)
        await pilot.click(table, offset=(10, 2))
        await sees(pilot, "topic /scan")
        assert table.cursor_row == 1

    play(BenchbotApp(look=Alive), scenario, (120, 40))


class WithoutPictures(EnvironmentsScreen):
    """The same in seconds: what the place looks like is traced for nobody."""

    def words(self) -> list[str]:
        return [*super().words(), "--no-pictures"]


def test_a_file_is_imported_with_what_was_guessed(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("BENCHBOT_PLUGINS")
    places.write(home / "work" / "flat.stl", places.flat(ceiling=False), up="z")

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        screen = WithoutPictures()
        app.push_screen(screen)
        await sees(pilot, "generate one from a seed")
        screen._way_field.value = "import"
        await sees(pilot, "Name a file to import.")
        await pilot.press("ctrl+s")
        await sees(pilot, "✗ Name a file to import.", "→ Type its path")
        screen._file_field.value = "nowhere.stl"
        await pilot.press("ctrl+s")
        await sees(pilot, "✗ ", "nowhere.stl", "→")
        screen._file_field.value = "flat.stl"
        await sees(pilot, "$ benchbot import-environment flat.stl")
        await pilot.press("ctrl+s")
        await until(pilot, lambda: not screen.is_busy)
        await sees(pilot, "✓ Made in", "flat:1", "unit m, up z", "It is open from above")

    play(BenchbotApp(look=Alive), scenario, (120, 40))
    assert (home / "work" / "flat" / "environments" / "flat_1.yaml").is_file()


def test_settings_are_kept(home: Path) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("S")
        await sees(pilot, "BENCHBOT_CACHE_DIR", "MiB")
        screen = app.screen
        assert isinstance(screen, SettingsScreen)
        screen._theme_field.value = "nord"
        await until(pilot, lambda: app.theme == "nord")
        screen._images_field.value = "sextant"
        await sees(pilot, "from the next start of")

    play(BenchbotApp(look=Alive), scenario)
    assert json.loads((home / "state" / "screens.json").read_text()) == {"theme": "nord", "images": "sextant"}

    async def again(app: BenchbotApp, pilot: Pilot[None]) -> None:
        assert app.theme == "nord"

    play(BenchbotApp(look=Alive), again)


@pytest.mark.parametrize("size", [*SIZES, (20, 5)])
def test_every_screen_opens_in_every_size(size: tuple[int, int], home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        for screen in SCREENS:
            app.push_screen(screen())
            await pilot.press("tab", "down", "up")
            app.pop_screen()

    app = BenchbotApp(look=Alive)
    play(app, scenario, size)
    assert not app.return_code


def test_a_list_to_check_says_by_a_letter_what_is_chosen(home: Path) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        names = CheckList()
        await app.screen.mount(names)
        names.offer({"a": "first\nline", "b": "second"}, chosen=["b"])
        names.focus()
        await sees(pilot, "[ ] first line", "[x] second")
        await pilot.press("space", "j", "space")
        await sees(pilot, "[x] first line", "[ ] second")
        assert names.chosen == ["a"]

    play(BenchbotApp(look=Alive), scenario)


def test_an_error_is_read_as_it_was_printed() -> None:
    said = [
        "Looking …",
        "Error: It cannot be.",
        "",
        "  Why not.",
        "  | said pip",
        "",
        "  Fix: Do this.",
        "       Or that.",
    ]
    error = error_in(said, 2)
    assert (error.title, error.why, error.fix) == ("It cannot be.", "Why not.\nsaid pip", "Do this.\nOr that.")


def test_a_command_that_is_ended_says_so(home: Path) -> None:
    heard: list[str] = []
    command = ChildCommand(["doctor", "--json"], heard.append)
    command.cancel()
    with pytest.raises(Exception, match="ended"):
        command.wait()
