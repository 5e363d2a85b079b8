"""Every command has a screen: a form of all that it takes, run by a real process."""

from pathlib import Path
from typing import Any

import pytest
from textual.pilot import Pilot
from textual.widgets import Input

from benchbot.cli.app import EVERYDAY, Stub
from benchbot.core import plugin_manager
from benchbot.core.light_records import Command
from benchbot.plugins.screens.child_command import as_typed
from benchbot.plugins.screens.widgets import ChoiceField
from benchbot.plugins.tui.any_command import AnyCommandScreen, leaves, offered
from benchbot.plugins.tui.app import BenchbotApp
from benchbot.plugins.tui.home import HomeScreen
from benchbot.plugins.tui.jobs import Alive
from tests.plugins.tui.playing import everywhere, play, sees, until


def records() -> dict[str, Command]:
    brought = (provided.value for provided in plugin_manager.load().pool("commands").values())
    return {record.name: record for record in [*EVERYDAY, *brought] if record.name != "tui"}


def test_the_palette_offers_every_command_and_each_takes_all_that_it_can_be_given(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("BENCHBOT_PLUGINS")

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await until(pilot, lambda: bool(app._commands))
        titles = {command.title for command in app.get_system_commands(app.screen)}
        assert titles >= {f"benchbot {name}" for name in records()}
        for record in records().values():
            screen = await opened(app, pilot, record)
            for words, command in leaves(Stub(record).load()):
                await choose(pilot, screen, words)
                taken = [parameter.name for parameter, _ in screen.fields.values()]
                assert taken == [parameter.name for parameter in offered(command)], f"{record.name} {words}"
                for parameter, field in screen.fields.values():
                    if parameter.required:
                        field.value = parameter.metavar.split("|")[0] if isinstance(field, ChoiceField) else "1"
                assert screen.words()[0] == record.name
            await pilot.press("escape")

    play(BenchbotApp(look=Alive), scenario, (120, 40))


def test_a_project_is_made_and_what_stands_in_the_way_of_another_is_told(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        await pilot.press("ctrl+p")
        await sees(pilot, "Keys")
        await pilot.press(*"benchbot new")
        await sees(pilot, "benchbot new")
        await pilot.press("enter")
        await until(pilot, lambda: isinstance(app.screen, AnyCommandScreen) and bool(app.screen.fields))
        screen = app.screen
        assert isinstance(screen, AnyCommandScreen)
        fill(screen, "kind", "environment")
        await pilot.press("ctrl+s")
        await sees(pilot, "✗ name is missing.")
        fill(screen, "name", "my room")
        await sees(pilot, "$ benchbot new environment 'my room'")
        await pilot.press("ctrl+s")
        await sees(pilot, "✗")
        fill(screen, "name", "acme-room")
        await pilot.press("ctrl+s")
        await sees(pilot, "✓ It has ended well.")
        await pilot.press("ctrl+s")
        await sees(pilot, "✗", "→")
        await pilot.press("escape")
        assert isinstance(app.screen, HomeScreen)

    play(BenchbotApp(look=Alive), scenario, (120, 40))
    assert (home / "work" / "acme-room" / "pyproject.toml").is_file()


@pytest.mark.parametrize(
    ("name", "sub", "values", "line"),
    [
        ("eval", "", {"results": "'my run' b.json", "--method": "omq"}, "benchbot eval --method=omq 'my run' b.json"),
        ("show", "task", {"name": "-odd"}, "benchbot show task -- -odd"),
        ("run", "", {"--task": "t", "--robot": "r", "--env": "e:1", "--set": "a=1 b='2 3'"},
         "benchbot run --task=t --robot=r --env=e:1 --set=a=1 '--set=b=2 3'"),
        ("batch", "run", {"--canary": "--no-canary"}, "benchbot batch run --no-canary"),
    ],
)  # fmt: skip
def test_the_command_line_is_what_one_would_type(
    name: str, sub: str, values: dict[str, str], line: str, home: Path
) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        screen = await opened(app, pilot, records()[name])
        await choose(pilot, screen, sub)
        for label, value in values.items():
            fill(screen, label, value)
        assert as_typed(screen.words()) == line

    play(BenchbotApp(look=Alive), scenario, (120, 40))


def test_a_command_goes_on_as_a_job_that_home_lists_and_ends(home: Path) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        screen = await opened(app, pilot, records()["run"])
        await pilot.press("ctrl+b")
        await sees(pilot, "✗ --task is missing.")
        screen = await opened(app, pilot, records()["list"])
        await choose(pilot, screen, "robots")
        await pilot.press("ctrl+b")
        await sees(pilot, "Ended: list robots", "ended well")
        await pilot.press("escape", "escape")
        await sees(pilot, "✓ list robots", "ended well")
        await pilot.press("enter")
        await sees(pilot, "list robots: ended well", "sample_robot")

    play(BenchbotApp(), scenario, (120, 40))


def test_a_server_tells_its_address_as_a_job_and_is_ended(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("BENCHBOT_PLUGINS")

    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        screen = await opened(app, pilot, records()["view"])
        fill(screen, "--port", "0")
        fill(screen, "--browser", "--no-browser")
        await pilot.press("ctrl+b", "escape")
        await sees(pilot, "view", "running")
        await pilot.press("enter")
        await sees(pilot, "view: running", "http://127.0.0.1:")
        await pilot.press("x")
        await sees(pilot, "End this job?")
        await pilot.press("x")
        await sees(pilot, "view: it was ended")

    play(BenchbotApp(), scenario, (120, 40))


def test_a_form_looks_as_it_is_kept(home: Path) -> None:
    async def scenario(app: BenchbotApp, pilot: Pilot[None]) -> None:
        screen = await opened(app, pilot, records()["bundle"])
        first = next(field.widget for _, field in screen.fields.values() if isinstance(field.widget, Input))
        first.focus()
        await sees(pilot, "benchbot bundle")
        await everywhere(app, pilot, "any-command")

    play(BenchbotApp(look=Alive), scenario)


async def opened(app: BenchbotApp, pilot: Pilot[None], record: Command) -> AnyCommandScreen:
    screen = AnyCommandScreen(record)
    await app.push_screen(screen)
    await until(pilot, lambda: bool(screen._forms))
    await pilot.pause()
    return screen


async def choose(pilot: Pilot[None], screen: AnyCommandScreen, words: str) -> None:
    """Choose a sub-command, and wait for its form."""
    if screen._which is not None and screen._which.value != words:
        screen._which.value = words
        wanted: list[Any] = offered(screen._forms[words])
        await until(pilot, lambda: [each for each, _ in screen.fields.values()] == wanted)
    await pilot.pause()


def fill(screen: AnyCommandScreen, label: str, value: str) -> None:
    """Give a parameter its value, by its label without the star of what must be given."""
    _, field = next(each for name, each in screen.fields.items() if name.rstrip(" *") == label)
    field.value = value
