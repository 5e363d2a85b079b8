"""Screens that plug-ins bring: by key and by name; one that is broken breaks nothing else; keys mean one thing."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from textual.binding import Binding
from textual.pilot import Pilot

from benchbot.core import entry_points, plugin_manager
from benchbot.core.light_records import Target, TuiScreen
from benchbot.plugins.installer.screen import PluginsScreen
from benchbot.plugins.tui import keys
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.home import HomeScreen
from benchbot.plugins.tui.jobs import Alive
from tests.plugin_factory import PluginFactory
from tests.plugins.tui.playing import play, sees, until

HOOKS = """\
from benchbot.plugin import TuiScreen, hookimpl

@hookimpl
def benchbot_screens():
    yield TuiScreen("greeting", "benchbot_greeting.screens:Greeting", "Say hello.", key="ctrl+g")
    yield TuiScreen("greedy", "benchbot_greeting.screens:Greeting", "Wants a key that has a meaning.", key="x")
    yield TuiScreen("absent", "benchbot_greeting.no_such:Screen", "Its module is not there.")
    yield TuiScreen("no screen", "benchbot_greeting.screens:number", "It is no screen.")
    yield TuiScreen("cannot compose", "benchbot_greeting.screens:CannotCompose", "It fails at once.")
    yield TuiScreen("fails later", "benchbot_greeting.screens:FailsLater", "It fails at a key.", key="ctrl+f")
"""
SCREENS = """\
from textual.binding import Binding
from textual.screen import Screen
from textual.widgets import Static

from benchbot.screens import CommandScreen, Facts

class Greeting(CommandScreen):
    HEADING = "Greeting"
    BINDINGS = [Binding("h", "greet", "Greet")]

    def body(self):
        yield Facts("Hello there.", id="hello")

    def words(self):
        return ["list", "tasks"]

    def action_greet(self):
        def listed(outcome):
            self.query_one("#hello", Facts).update(f"{len(outcome.document)} tasks")
        self.run_command([*self.words(), "--json"], listed, doing="Listing", only_looks=True)

def number():
    return 5

class CannotCompose(Screen):
    def compose(self):
        raise ValueError("never")

class FailsLater(Screen):
    BINDINGS = [Binding("h", "boom", "Boom")]

    def compose(self):
        yield Static("Not yet.")

    def action_boom(self):
        raise RuntimeError("now")
"""


@pytest.fixture
def greeting(home: Path, plugin_factory: PluginFactory, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A third party's plug-in with screens, most of them broken."""
    plugin_factory.make("benchbot-greeting", HOOKS, {"screens.py": SCREENS})
    monkeypatch.setenv("BENCHBOT_PLUGINS", "benchbot-sample,benchbot-greeting")
    plugin_manager.load.cache_clear()
    yield
    plugin_manager.load.cache_clear()


async def read(app: BenchbotApp, pilot: Pilot[None]) -> None:
    """Wait until the screens of other distributions are known."""
    await until(pilot, lambda: "greeting" in app._registered, "The plug-in's screens")


def test_a_plugins_screen_opens_by_its_key_and_runs_its_command(greeting: None) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await read(app, pilot)
        await pilot.press("ctrl+g")
        await sees(pilot, "Greeting", "Hello there.", "$ benchbot list tasks")
        await pilot.press("ctrl+g")  # it is open already
        await pilot.press("h")
        await sees(pilot, "6 tasks")
        await pilot.press("question_mark")
        await sees(pilot, "Greet", "ctrl+g", "Say hello.")
        await pilot.press("escape", "escape")
        assert isinstance(app.screen, HomeScreen)

    play(BenchbotApp(look=Alive), scenario)


def test_every_screen_and_action_is_in_the_palette(greeting: None) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await read(app, pilot)
        offered = {command.title for command in app.get_system_commands(app.screen)}
        assert {*map(str.capitalize, app._registered), "New run", "Results", "Keys", "Quit", "Submit"} <= offered
        await pilot.press("ctrl+p")
        await sees(pilot, "Search for commands")
        await pilot.press(*"greeting", "enter")
        await sees(pilot, "Hello there.")

    play(BenchbotApp(look=Alive), scenario)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("absent", "no_such"),
        ("no screen", "number gave 5"),
        ("cannot compose", "ValueError: never"),
    ],
)
def test_a_screen_that_is_broken_is_named_and_the_others_go_on(name: str, why: str, greeting: None) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await read(app, pilot)
        app.open_screen(name)
        await sees(pilot, f"The screen '{name}' does not work.", why, "benchbot uninstall")
        assert isinstance(app.screen, HomeScreen)
        app.open_screen("plug-ins")
        await sees(pilot, "benchbot-sample")
        assert isinstance(app.screen, PluginsScreen)

    app = BenchbotApp(look=Alive)
    play(app, scenario, (120, 40))
    assert not app.return_code


def test_a_screen_that_fails_later_is_left(greeting: None) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await read(app, pilot)
        await pilot.press("ctrl+f")
        await sees(pilot, "Not yet.")
        # Not by `press`, which waits for the screen that fails.
        app.call_later(app.simulate_key, "h")
        await sees(pilot, "The screen 'fails later' does not work.", "RuntimeError: now")
        assert isinstance(app.screen, HomeScreen)
        await pilot.press("ctrl+g")
        await sees(pilot, "Hello there.")

    app = BenchbotApp(look=Alive)
    play(app, scenario, (120, 40))
    assert not app.return_code


def test_a_key_that_has_a_meaning_is_not_given_away(greeting: None) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await read(app, pilot)
        assert app._registered["greedy"].key == ""
        assert app._registered["greeting"].key == "ctrl+g"

    play(BenchbotApp(look=Alive), scenario)


def test_each_key_of_the_registered_screens_has_the_meaning_of_the_table() -> None:
    meant = {}
    for record in [*entry_points.shipped("screens"), *_of_scenes()]:
        assert record.name in keys.MEANINGS[record.key].labels
        meant[record.name] = Target(record.target).load()
    for name, screen in {**meant, "app": BenchbotApp}.items():
        for binding in screen.BINDINGS:
            assert isinstance(binding, Binding)
            for key in binding.key.split(","):
                if key in keys.MEANINGS:
                    assert binding.description in keys.MEANINGS[key].labels, (name, key)
                else:
                    assert key in keys.SAME, f"{key} of {name} is not in the table of keys."


def test_no_word_stands_for_two_keys() -> None:
    labels = [(label, key) for key, meaning in keys.MEANINGS.items() for label in meaning.labels]
    twice = {label for label, key in labels for other, there in labels if label == other and key != there}
    assert twice <= {"Quit", "Back"}


def test_screens_are_imported_when_they_are_opened(home: Path) -> None:
    modules = [record.target.partition(":")[0] for record in entry_points.shipped("screens")]
    code = (
        "import sys; from benchbot.plugins.tui import app, registered_screens; registered_screens.shipped();"
        f"print([name for name in {modules!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def _of_scenes() -> list[TuiScreen]:
    from benchbot_scenes.plugin import benchbot_screens

    return list(benchbot_screens())
